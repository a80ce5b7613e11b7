"""Units and convention of a robot file's Denavit-Hartenberg table, as stated and as likely meant."""

from __future__ import annotations

import numpy as np
import pytest
import yaml

from robots.common.errors import AssumedValueWarning, InputError
from robots.geometry.dh import DhRow, chain_from_dh
from robots.geometry.dh_tables import table_notes
from robots.loading import load_robot

pytestmark = pytest.mark.filterwarnings(f"ignore::{AssumedValueWarning.__module__}.{AssumedValueWarning.__name__}")

# a [m], alpha [deg], d [m], offset [deg] of the ER3A, modified convention
ER3A = [
    (0.0, 0, 0.3215, 0),
    (0.05, 90, 0.0, 90),
    (0.27, 0, 0.0, 0),
    (0.07, 90, 0.299, 0),
    (0.0, -90, 0.0, 0),
    (0.0, 90, 0.078, 0),
]
# a [m], alpha [deg], d [m], offset [deg] of the PUMA 560 in the standard convention (Corke's toolbox)
PUMA = [(0.0, 90, 0.0, 0), (0.4318, 0, 0.0, 0), (0.0203, -90, 0.15005, 0), (0.0, 90, 0.4318, 0), (0.0, -90, 0.0, 0)]
PUMA.append((0.0, 0, 0.0, 0))


@pytest.fixture
def write(tmp_path):
    """Writes a robot file of the ER3A's table in some units."""

    def _write(length=1.0, angle=1.0, **units):
        joints = [
            {"a": length * a, "alpha": angle * alpha, "d": length * d, "offset": angle * offset}
            for a, alpha, d, offset in ER3A
        ]
        path = tmp_path / "arm.yaml"
        path.write_text(
            yaml.safe_dump({"name": "arm", "geometry": {"convention": "modified", "joints": joints} | units})
        )
        return path

    return _write


def test_the_same_arm_in_all_units(write):
    """Degrees and radians, metres and millimetres describe one arm."""
    rows = [DhRow(a=a, alpha=np.deg2rad(alpha), d=d, offset=np.deg2rad(offset)) for a, alpha, d, offset in ER3A]
    q = np.linspace(-1, 1, 6)
    expected = chain_from_dh(rows, "modified").flange(q)
    for stated in (
        write(angles="deg"),
        write(length=1e3, angles="deg", lengths="mm"),
        write(angle=np.pi / 180, lengths="m"),
    ):
        np.testing.assert_allclose(load_robot(stated).chain.flange(q), expected, atol=1e-15)


@pytest.mark.parametrize(
    ("stated", "message"),
    [
        ({}, r"geometry.joints\[2\].alpha, joint 2: 90 rad; .* if the table is in degrees, state angles: deg"),
        (
            {"angle": np.pi / 180, "angles": "deg"},
            r"geometry.joints\[2\].alpha, joint 2: 1.5708 deg, .* state angles: rad",
        ),
        (
            {"angle": 1.57 / 90, "angles": "deg"},
            r"geometry.joints\[2\].alpha, joint 2: 1.57 deg, .* state angles: rad",
        ),
        (
            {"length": 1e3, "angles": "deg"},
            r"geometry.joints\[1\].d, joint 1: 321.5 m; all a and d add up to 1.09e\+03 m.* state lengths: mm",
        ),
        (
            {"angles": "deg", "lengths": "mm"},
            r"geometry.joints\[1\].d, joint 1: 0.3215 mm; all a and d add up to 0.00109 m.* state lengths: m$",
        ),
    ],
)
def test_other_units_are_refused(stated, message, write):
    """Values that are only possible in another unit name joint and key, and the unit to state."""
    with pytest.raises(InputError, match=message):
        load_robot(write(**stated))


def test_calibrated_tables_in_degrees_are_read(write):
    """Twists of a calibrated table are near right angles in degrees, and small ones near zero."""
    path = write(angles="deg")
    path.write_text(path.read_text().replace("alpha: 90.0", "alpha: 90.03").replace("alpha: 0.0", "alpha: 1.57"))
    assert load_robot(path).chain.n == 6


def rows(table):
    """Rows in rad and m."""
    return [DhRow(a=a, alpha=np.deg2rad(alpha), d=d, offset=np.deg2rad(offset)) for a, alpha, d, offset in table]


def test_the_other_convention_is_named():
    """A table that only makes an arm in the other convention has a note; in its own it has none."""
    assert table_notes(rows(ER3A), "modified") == ()
    assert table_notes(rows(PUMA), "standard") == ()
    assert "looks like one of the modified convention" in table_notes(rows(ER3A), "standard")[0]
    assert "looks like one of the standard convention" in table_notes(rows(PUMA), "modified")[0]


def test_arms_without_a_wrist_have_no_note():
    """SCARAs and short chains, whose axes are parallel by design, are of either convention."""
    scara = [(0.35, 0, 0.3, 0), (0.25, 180, 0.0, 0), (0.0, 0, 0.1, 0), (0.0, 0, 0.05, 0)]
    pendulum = [(0.0, 90, 0.0, 0), (0.4, 0, 0.0, 0)]
    for table in (scara, pendulum):
        for convention in ("modified", "standard"):
            assert table_notes(rows(table), convention) == ()


def test_long_arms_have_a_note():
    """Lengths of a crane are possible, and named all the same."""
    assert table_notes(rows([(12.0, 0, 0.0, 0), (9.0, 0, 0.0, 0)]), "modified") == (
        "a and d of the table add up to 21 m, most of it a of joint 1: they may be in mm (lengths: mm)",
    )

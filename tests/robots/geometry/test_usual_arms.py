"""Masses of a usual arm against data sheets, described robots, and physics."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from robots.common.errors import AssumedValueWarning, InputError
from robots.consistency import normalised_eigenvalues
from robots.geometry.usual_arms import (
    PAYLOAD_EXPONENT,
    REACH_EXPONENT,
    USUAL_MASS,
    usual_body,
    usual_masses,
    working_reach,
)
from robots.loading import load_robot

# payload [kg], reach [m], mass [kg] of the manufacturers' data sheets
SHEETS = np.array(
    [
        (3, 0.5, 11.2),  # UR3e
        (5, 0.85, 20.6),  # UR5e
        (12.5, 1.3, 33.5),  # UR10e
        (16, 0.9, 33.1),  # UR16e
        (20, 1.75, 64),  # UR20
        (3, 0.855, 18),  # Panda
        (7, 0.8, 23.9),  # LBR iiwa 7
        (14, 0.82, 29.9),  # LBR iiwa 14
        (3, 0.58, 25),  # IRB 120
        (7, 0.703, 52),  # IRB 1200
        (10, 1.45, 250),  # IRB 1600
        (20, 1.65, 272),  # IRB 2600
        (60, 2.05, 425),  # IRB 4600
        (200, 2.6, 1250),  # IRB 6700
        (6, 0.901, 52),  # KR 6 R900
        (16, 1.61, 245),  # KR 16 R1610
        (210, 2.7, 1068),  # KR 210 R2700
        (7, 0.717, 25),  # LR Mate 200iD
        (12, 1.42, 130),  # M-10iA/12
        (20, 1.811, 250),  # M-20iA
        (165, 2.655, 1090),  # R-2000iC/165F
        (7, 0.927, 34),  # GP7
        (25, 1.73, 250),  # GP25
        (2, 0.515, 27),  # TX40
        (3.5, 0.67, 51),  # TX60
        (3.5, 0.7, 13.7),  # xArm 7
        (4, 0.902, 8.2),  # Gen3
    ]
)


def test_the_mass_follows_data_sheets():
    """The constants are the least-squares fit of the data sheets, rounded; these scatter by the stated factor."""
    payload, reach, mass = np.log(SHEETS).T
    matrix = np.column_stack([np.ones_like(mass), payload, reach])
    fit = np.linalg.lstsq(matrix, mass, rcond=None)[0]
    np.testing.assert_allclose([np.log(USUAL_MASS), PAYLOAD_EXPONENT, REACH_EXPONENT], fit, atol=0.01)
    assert np.exp((mass - matrix @ fit).std()) == pytest.approx(1.8, abs=0.05)


@pytest.mark.parametrize(
    ("name", "payload", "reach"), [("ur10", 10.0, 1.3), ("panda", 3.0, 0.855), ("er3a", 3.0, 0.63)]
)
def test_described_arms_are_usual(name, payload, reach):
    """Masses behind the first joint of arms that are known are within a factor of two and a half, heavy links first."""
    robot = load_robot(name)
    assert working_reach(robot.chain, robot.limits) == pytest.approx(reach, rel=0.15)
    usual = usual_masses(robot.chain, robot.limits, payload)
    assert 0.4 < usual[:, 0].sum() / robot.inertia[:, 0].sum() < 2.5
    assert (np.diff(usual[:, 0]) <= 0).all()
    assert (normalised_eigenvalues(usual) > 1e-3).all()


def test_a_usual_body_is_about_its_middle():
    """The mass is in the middle of the link, and the inertia there is that of the stated spread."""
    body = usual_body(2.0, [0.0, 0.0, 0.4], 1.0)
    spread = (0.2 * 0.4 + 0.05) ** 2
    across = 2 * (2 * spread + 0.2**2)
    np.testing.assert_allclose(body, [2, 0, 0, 0.4, across, 0, 0, across, 0, 4 * spread], atol=1e-15)


def test_only_unknown_masses_are_assumed():
    """Known links stay; the robot lists what is assumed, and its words on the command line make it again."""
    known = load_robot("ur10")
    inertia = np.array(known.inertia)
    inertia[[0, 2]] = np.nan
    with pytest.warns(
        AssumedValueWarning, match=r"masses of links 1 and 3 \(usual for 10 kg payload and 1.\d m reach\)"
    ):
        robot = load_robot(replace(known, inertia=inertia), assume_masses=10.0)
    assert robot.has_inertia
    np.testing.assert_array_equal(robot.inertia[[1, 3, 4, 5]], known.inertia[[1, 3, 4, 5]])
    assert robot.assumed[-1].startswith("masses of links 1 and 3")
    assert robot.stated == "ur10 --assume-masses 10"


def test_nothing_is_assumed_of_known_masses():
    """A robot with all masses keeps them, and a note says so; a payload of nothing is refused."""
    known = load_robot("ur10")
    with pytest.warns(AssumedValueWarning, match="states all masses, so none are assumed"):
        assert load_robot(known, assume_masses=10.0) is known
    for payload in (0.0, -1.0, np.nan):
        with pytest.raises(InputError, match="a positive mass"):
            load_robot(known, assume_masses=payload)

"""A rigid body in a frame, and the texts that state one."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from estimation.payloads.body import FORMAT, Body, read_body
from robots.common.errors import InputError
from robots.terms.situations.flange_body import point_mass

INERTIA = np.array([[0.004, 0.0002, -0.0003], [0.0002, 0.003, 0.0001], [-0.0003, 0.0001, 0.002]])


@pytest.fixture
def body() -> Body:
    """A body whose centre is off the origin."""
    return Body.of(1.5, [0.02, -0.01, 0.1], INERTIA)


def test_a_body_gives_back_what_it_was_made_of(body: Body) -> None:
    """Mass, centre, and inertia about the centre, to rounding."""
    assert body.mass == 1.5
    np.testing.assert_allclose(body.centre, [0.02, -0.01, 0.1], rtol=1e-14)
    np.testing.assert_allclose(body.inertia, INERTIA, rtol=1e-12, atol=1e-17)
    assert body.possible


def test_another_frame_sees_the_body_as_pinocchio_does(body: Body) -> None:
    """`seen_from` with a pose is the inverse action of that pose on an inertia."""
    pose = pin.SE3(pin.rpy.rpyToMatrix(0.3, -0.7, 1.1), np.array([0.05, -0.2, 0.1]))
    expected = pose.actInv(pin.Inertia(1.5, np.array([0.02, -0.01, 0.1]), INERTIA))
    seen = body.seen_from(pose.homogeneous)
    assert seen.mass == pytest.approx(1.5)
    np.testing.assert_allclose(seen.centre, expected.lever, atol=1e-14)
    np.testing.assert_allclose(seen.inertia, expected.inertia, atol=1e-15)


@pytest.mark.parametrize("seed", range(5))
def test_principal_axes_rebuild_the_inertia_and_stay_near_the_frame(seed: int) -> None:
    """The axes are a rotation, and none is farther from its own axis than from the others."""
    turn = pin.exp3(np.random.default_rng(seed).normal(size=3) * 0.3)
    moments, axes = Body.of(1.0, [0.1, 0, 0], turn @ np.diag([1e-3, 2e-3, 2.5e-3]) @ turn.T).principal
    np.testing.assert_allclose(
        axes @ np.diag(moments) @ axes.T, turn @ np.diag([1e-3, 2e-3, 2.5e-3]) @ turn.T, atol=1e-15
    )
    assert np.linalg.det(axes) == pytest.approx(1.0)
    # A turn of up to 1 rad leaves each axis nearest to the one that it was.
    assert (np.diag(axes) > 0.5).all()


def test_a_payload_is_read_from_four_numbers_or_a_file(body: Body, tmp_path: Path) -> None:
    """KG,X,Y,Z is a point mass; a payload.json or its folder states all ten parameters."""
    np.testing.assert_array_equal(read_body("2,0.1,0,-0.2").parameters, point_mass(2.0, (0.1, 0.0, -0.2)))
    data = {"format": FORMAT, "format_version": 1, "parameters": body.parameters.tolist()}
    (tmp_path / "payload.json").write_text(json.dumps(data))
    for text in (tmp_path, tmp_path / "payload.json"):
        np.testing.assert_array_equal(read_body(str(text)).parameters, body.parameters)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("2,0.1,0", "KG,X,Y,Z"),
        ("2,0.1,0,z", "KG,X,Y,Z"),
        ("2,0.1,0,nan", "finite"),
        ("-2,0.1,0,0", "mass of -2 kg"),
        ("missing.json", "no such file"),
    ],
)
def test_what_states_no_payload_is_refused(text: str, words: str) -> None:
    """A wrong number of values, no number, a negative mass, a file that is not there."""
    with pytest.raises(InputError, match=words):
        read_body(text)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"format": "other"}, "not a payload file"),
        ({"format_version": 99}, "format version 99"),
        ({"parameters": [1, 2]}, "shape"),
        ({"parameters": None}, "damaged|shape"),
        ({"parameters": [-1, *[0] * 9]}, "mass of -1"),
        ({"parameters": [1, 0.1, 0, 0, *[1e-5, 0, 0, 1e-5, 0, 1e-5]]}, "negative principal moment"),
    ],
)
def test_a_damaged_payload_file_is_refused_by_name(change: dict, words: str, tmp_path: Path) -> None:
    """Another format, a later version, missing numbers, and a body that cannot exist."""
    data = {"format": FORMAT, "format_version": 1, "parameters": point_mass(1.0, (0, 0, 0.1)).tolist(), **change}
    file = tmp_path / "payload.json"
    file.write_text(json.dumps(data))
    with pytest.raises(InputError, match=words) as caught:
        read_body(str(file))
    assert "payload.json" in str(caught.value)

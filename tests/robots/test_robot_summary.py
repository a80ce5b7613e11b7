"""A robot as text and as data."""

from __future__ import annotations

import json

import numpy as np
import pinocchio as pin
import pytest

from robots.loading import CATALOG, load_robot
from robots.robot_summary import robot_data, robot_summary
from tests.robots.robot_files import TABLE, URDF


def test_data_agrees_with_pinocchio():
    """Masses, centres of mass, axes and origins of the UR10 at zero are those that pinocchio reads."""
    data = robot_data(load_robot("ur10"))
    model = pin.buildModelFromUrdf(str(CATALOG / "ur10.urdf"))
    state = model.createData()
    pin.forwardKinematics(model, state, pin.neutral(model))
    for index, (joint, link) in enumerate(zip(data["joints"], data["links"], strict=True), start=1):
        body = model.inertias[index]
        assert link["mass"] == pytest.approx(body.mass)
        np.testing.assert_allclose(link["com"], body.lever, atol=1e-12)
        moments = np.linalg.eigvalsh(body.inertia)
        np.testing.assert_allclose(link["principal_moments"], moments, rtol=1e-9)
        np.testing.assert_allclose(joint["origin"], state.oMi[index].translation, atol=1e-12)
    np.testing.assert_allclose(data["joints"][1]["axis"], state.oMi[2].rotation @ [0, 1, 0], atol=1e-12)


@pytest.mark.parametrize("name", ["er3a", "ur10", "panda"])
def test_every_robot_is_plain_data(name):
    """The data are JSON without special numbers, one joint and one link a joint."""
    robot = load_robot(name)
    data = json.loads(json.dumps(robot_data(robot), allow_nan=False))
    assert [joint["joint"] for joint in data["joints"]] == list(range(1, robot.n + 1))
    assert len(data["links"]) == robot.n
    assert data["moved_mass"] == pytest.approx(robot.inertia[:, 0].sum())


def test_units_and_assumed_limits_are_shown(tmp_path):
    """A slide is shown in metres and newtons; a limit that is not stated has an asterisk; notes follow."""
    path = tmp_path / "two.urdf"
    path.write_text(URDF)
    text = robot_summary(load_robot(path))
    first, second = (line for line in text.splitlines() if " j" in line and "s, N" in line)
    assert first.split()[:2] == ["1", "j1"]
    assert first.endswith("rad, s, N m")
    assert {"8*", "160*"} <= set(first.split())
    assert second.endswith("m, s, N")
    assert "prismatic  -0.1 to 0.1" in second
    assert "* not stated" in text
    assert "note: assumed, because the URDF does not state it" in text
    data = robot_data(load_robot(path))
    assert data["joints"][1]["units"] == {"position": "m", "torque": "N"}
    assert data["joints"][0]["limits"]["acceleration"] is None


def test_unknown_bodies_and_assumptions_are_shown(tmp_path):
    """A table without bodies shows them as unknown; values without a source are listed."""
    path = tmp_path / "pair.yaml"
    start, end = TABLE.index("  links:"), TABLE.index("  drives:")
    path.write_text(
        TABLE[:start] + TABLE[end:].replace("cubic: {values: [3, 4]}", "cubic: {values: 3, source: assumed}")
    )
    robot = load_robot(path)
    text = robot_summary(robot)
    assert "unknown mass" in text
    assert "note: values without a source: dynamics.friction.cubic" in text
    data = robot_data(robot)
    assert data["moved_mass"] is None
    assert data["links"][0]["mass"] is None

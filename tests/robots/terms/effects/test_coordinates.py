"""The coordinate against which a finding is drawn has the unit of its joint."""

from __future__ import annotations

from dataclasses import replace

import pytest

from robots.geometry.chain import Chain
from robots.terms.effects import EFFECTS

DRAWN = {
    "stribeck": ((0.1,), "/s"),
    "asymmetric_friction": ((), "/s"),
    "encoder_offset": ((), ""),
    "position_dependent_friction": ((3.0,), ""),
    "presliding_hysteresis": ((0.01,), ""),
}


@pytest.mark.parametrize("name", DRAWN)
def test_lengths_of_linear_axes_are_metres(name, seen, random_robot):
    """Positions and velocities of a slide are in m and m/s, those of a revolute joint in rad and rad/s."""
    robot = random_robot(2, 3)
    kinds = ("revolute", "prismatic", "revolute")
    joints = tuple(replace(joint, kind=kind) for joint, kind in zip(robot.chain.joints, kinds, strict=True))
    now = seen(3, robot=replace(robot, chain=Chain(joints)))
    shape, rate = DRAWN[name]
    labels = [EFFECTS[name].coordinate(now, joint, shape)[0] for joint in (1, 2)]
    assert labels[0].endswith(f"[rad{rate}]")
    assert labels[1].endswith(f"[m{rate}]")


def test_loads_of_linear_axes_are_newtons(seen, random_robot):
    """The load of a slide is in N, that of a revolute joint in N m."""
    robot = random_robot(2, 3)
    kinds = ("revolute", "prismatic", "revolute")
    joints = tuple(replace(joint, kind=kind) for joint, kind in zip(robot.chain.joints, kinds, strict=True))
    now = seen(3, robot=replace(robot, chain=Chain(joints)))
    labels = [EFFECTS["torque_constant_error"].coordinate(now, joint)[0] for joint in (1, 2)]
    assert labels[0].endswith("[N m]")
    assert labels[1].endswith("[N]")

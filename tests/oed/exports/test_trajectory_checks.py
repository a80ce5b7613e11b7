"""A trajectory is written for a robot only if that robot may play it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from oed.exports import CONTROLLER_FORMS, check_trajectory, export_trajectory, is_made_for
from robots.common.errors import InputError
from robots.loading import load_robot
from robots.robot import Robot
from robots.signals import Motion


@pytest.fixture(scope="module")
def robot() -> Robot:
    """Load a robot of six joints whose dynamics are described."""
    return load_robot("er3a")


def move(robot: Robot, size: float = 0.1, joint: int = 0, time: float = 2.0) -> Motion:
    """One joint swings out and back, at rest at both ends."""
    t = 0.004 * np.arange(round(time / 0.004) + 1)
    w = np.pi / t[-1]
    one = np.eye(robot.n)[joint] * size
    return Motion(
        t,
        robot.limits.home + np.outer(np.sin(w * t) ** 2, one),
        np.outer(w * np.sin(2 * w * t), one),
        np.outer(2 * w**2 * np.cos(2 * w * t), one),
    )


def weak(robot: Robot) -> Robot:
    """The robot with a torque limit at joint 3 that the move needs more than."""
    torque = robot.limits.torque.copy()
    torque[2] = 1e-3
    return replace(robot, limits=replace(robot.limits, torque=torque))


def faults(robot: Robot) -> dict[str, tuple[Motion, Robot, dict[str, object], str]]:
    """Trajectories that the robot must not play, with what the message says."""
    good = move(robot)
    fewer = Motion(good.t, good.q[:, :2], good.dq[:, :2], good.ddq[:, :2])
    return {
        "robot": (good, robot, {"robot": "panda"}, "of the robot panda, not of er3a"),
        "number": (fewer, robot, {}, "has 2 joints, er3a has 6"),
        "units": (good, robot, {"kinds": ["prismatic", *5 * ["revolute"]]}, "joint 1: .* prismatic by the units"),
        "position": (move(robot, 30.0, time=60.0), robot, {}, "joint 1: upper 30 rad"),
        "velocity": (move(robot, 1.0, time=0.4), robot, {}, "joint 1: velocity .* rad/s at"),
        "acceleration": (move(robot, 0.02, time=0.032), robot, {}, "joint 1: acceleration .* rad/s2 at"),
        "torque": (good, weak(robot), {}, "joint 3: torque .* N m at .* beyond the limit 0.001 N m"),
        "rest": (good.slice(100, None), robot, {}, "begins with a speed"),
    }


FAULTS = ("robot", "number", "units", "position", "velocity", "acceleration", "torque", "rest")


@pytest.mark.parametrize("fault", FAULTS)
def test_what_a_robot_must_not_play(fault: str, robot: Robot, tmp_path: Path) -> None:
    """Every form refuses another robot and a limit of any kind that is exceeded, and writes nothing."""
    motion, given, metadata, problem = faults(robot)[fault]
    with pytest.raises(InputError, match=problem):
        check_trajectory(motion, given, metadata, "trajectory.csv")
    for name, form in CONTROLLER_FORMS.items():
        path = tmp_path / f"a{form.suffixes[0]}"
        with pytest.raises(InputError, match=problem):
            export_trajectory(path, motion, given, name, metadata=metadata)
        assert not path.exists()


def test_what_a_robot_may_play(robot: Robot) -> None:
    """A trajectory within all limits passes; without described dynamics no torque is known."""
    check_trajectory(move(robot), robot, {"robot": "er3a", "kinds": ["revolute"] * 6})
    check_trajectory(move(robot), replace(weak(robot), inertia=None), {})


def test_robots_are_known_by_name_or_file(robot: Robot) -> None:
    """The same file in another folder is the same robot."""
    own = replace(robot, name="arm", origin="/cells/left/arm_v2.urdf")
    assert all(is_made_for(stated, own) for stated in ("arm", "arm_v2.urdf", "elsewhere/arm_v2.urdf"))
    assert not any(is_made_for(stated, own) for stated in ("er3a", "left", "arm_v3.urdf"))

"""Whether the joints that a controller reports are those of the robot."""

from __future__ import annotations

import warnings

import numpy as np

from robots.common.arrays import Array
from robots.common.errors import InputError, OtherRobotWarning
from robots.robot import Robot


def require_no_further_joints(unused: Array, robot: Robot) -> None:
    """Refuses a controller that reports more joints than the robot has.

    Args:
        unused: what it reports of further joints (m,); zero where there is none.
        robot: the robot.

    Raises:
        InputError: naming the joint.
    """
    if np.abs(unused).max(initial=0.0) > 0:
        joint = robot.n + int(np.abs(unused).argmax()) + 1
        raise InputError(
            f"the controller reports a joint {joint}, {robot.name} has {robot.n}",
            joint=joint,
            remedy="the controller is of another robot: correct --robot; or these are external axes: --external-axes",
        )


def warn_of_other_robot(robot: Robot, lowest: Array, highest: Array, planned: Array | None = None) -> None:
    """Warns of what `doubts_about_robot` finds."""
    for doubt in doubts_about_robot(robot, lowest, highest, planned):
        warnings.warn(OtherRobotWarning(doubt), stacklevel=3)


def doubts_about_robot(robot: Robot, lowest: Array, highest: Array, planned: Array | None = None) -> list[str]:
    """Names what contradicts a robot in the positions that its controller reports.

    Feedback does not say how many joints there are: those that a controller lacks read zero.

    Args:
        robot: the robot.
        lowest: smallest reported positions (10,) [rad or m].
        highest: largest ones (10,).
        planned: the positions that were played (N, n); a joint that is held at zero reads zero.
    """
    found, n = [], robot.n
    silent = (lowest[:n] == 0) & (highest[:n] == 0)
    if planned is not None:
        silent &= (planned != 0).any(axis=0)
    real = int(np.flatnonzero(~silent)[-1]) + 1 if (~silent).any() else n
    if real < n:
        joints = ", ".join(str(joint) for joint in range(real + 1, n + 1))
        found.append(
            f"joint {joints} of {robot.name} reads exactly 0 all the time: it stands at zero, or the controller has "
            f"{real} joints (check --robot)"
        )
    # Distance from a limit of position from which it is no rounding or overshoot [rad or m].
    beyond = 0.02
    for joint in range(n):
        lower, upper = float(robot.limits.lower[joint]), float(robot.limits.upper[joint])
        outside = lowest[joint] if lowest[joint] < lower - beyond else highest[joint]
        in_degrees = robot.chain.kinds[joint] == "revolute" and abs(outside) > 2 * np.pi
        cause = "be of another robot, or send degrees" if in_degrees else "be of another robot"
        if lowest[joint] < lower - beyond or highest[joint] > upper + beyond:
            found.append(
                f"joint {joint + 1} is reported at {outside:.3g} {robot.limits.unit(joint)}, outside the limits of "
                f"{robot.name} ({lower:.3g} to {upper:.3g}): the controller may {cause}. Check --robot"
            )
    return found

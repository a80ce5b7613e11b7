"""Checks before anything moves: the trajectory against the robot, the controller's state, and the start pose."""

from __future__ import annotations

from collections.abc import Mapping
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import NDArray

from oed.controllers.errors import ControllerError
from oed.exports.simple_message import Status
from oed.exports.simple_message.kinds import JOINTS, MANUAL
from robots.common.errors import InputError
from robots.robot import Robot
from robots.signals import Motion

Array = NDArray[np.float64]

REST = 1e-3
"""Speed at both ends up to which the robot stands [rad/s or m/s]."""

SHARE = 1e-6
"""A limit may be exceeded by this share: trajectories touch their limits, and files round."""


def check_trajectory(
    motion: Motion, robot: Robot, metadata: Mapping[str, Any], file: str | PathLike[str] | None = None
) -> None:
    """Refuses a trajectory that this robot must not play.

    Args:
        motion: the trajectory.
        robot: the robot.
        metadata: what the file says of itself.
        file: for messages.

    Raises:
        InputError: a trajectory of another robot, more joints than messages have, a limit of position, velocity or
            acceleration that is exceeded, or a motion at an end.
    """
    named = metadata.get("robot")
    if named and named not in (robot.name, robot.origin):
        raise InputError(
            f"the trajectory is of the robot {named}, not of {robot.name}", file=file, remedy="give its own robot"
        )
    if motion.n != robot.n:
        raise InputError(f"the trajectory has {motion.n} joints, {robot.name} has {robot.n}", file=file)
    if motion.n > JOINTS:
        raise InputError(f"{motion.n} joints", file=file, allowed=f"up to {JOINTS}, as simple_message has")
    for margin in robot.limits.margins(motion):
        if margin.quantity != "jerk" and margin.slack < -SHARE * max(abs(margin.limit), 1.0):
            raise InputError(
                f"{margin.quantity} {margin.value:.4g} at {margin.time:.4g} s is beyond the limit {margin.limit:.4g}",
                file=file,
                joint=margin.joint,
                remedy=f"design or retime it within the limits of {robot.name}",
            )
    for row, where in ((0, "begins"), (-1, "ends")):
        joint = int(np.abs(motion.dq[row]).argmax())
        if abs(motion.dq[row, joint]) > REST:
            raise InputError(
                f"the trajectory {where} with a speed of {motion.dq[row, joint]:.3g}",
                file=file,
                joint=joint + 1,
                allowed="rest at both ends",
            )


def check_status(status: Status | None, place: str) -> None:
    """Refuses a controller that is not ready to move.

    Args:
        status: its last status; None where it reports none.
        place: of the controller, for the message.

    Raises:
        ControllerError: an emergency stop, an error, manual mode, no drive power, or motion not possible.
    """
    problem = status_problem(status)
    if problem is not None:
        raise ControllerError(
            f"the controller at {place} reports {problem}",
            remedy="clear it at the controller, or ignore the status (--ignore-status)",
        )


def status_problem(status: Status | None) -> str | None:
    """Names what keeps a controller from moving; None for nothing that it reports."""
    if status is None:
        return None
    if status.e_stopped == 1:
        return "an emergency stop"
    if status.in_error == 1 or status.error_code:
        return f"the error {status.error_code}"
    if status.mode == MANUAL:
        return "manual mode"
    if status.drives_powered == 0:
        return "drives without power"
    if status.motion_possible == 0:
        return "that motion is not possible"
    return None


def check_start(first: Array, reported: Array, tolerance: float, unused: Array) -> None:
    """Refuses a trajectory that begins elsewhere than the robot stands.

    Args:
        first: first point (n,) [rad or m].
        reported: positions of the robot (n,).
        tolerance: farthest distance of a joint.
        unused: what the controller reports of further joints (m,); zero where there is none.

    Raises:
        InputError: another pose, or a robot with more joints.
    """
    if np.abs(unused).max(initial=0.0) > 0:
        joint = len(first) + int(np.abs(unused).argmax()) + 1
        raise InputError(
            f"the controller reports a joint {joint}, the robot has {len(first)}",
            joint=joint,
            remedy="the controller is of another robot",
        )
    away = np.abs(reported - first)
    joint = int(away.argmax())
    if away[joint] > tolerance:
        raise InputError(
            f"the robot is at {reported[joint]:.5g}, the trajectory begins at {first[joint]:.5g}",
            joint=joint + 1,
            allowed=f"a distance up to {tolerance:g}",
            remedy="move the robot to the start of the trajectory first",
        )

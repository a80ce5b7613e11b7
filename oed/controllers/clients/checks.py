"""Checks before anything moves: the controller's state and the start pose."""

from __future__ import annotations

import numpy as np

from oed.controllers.errors import ControllerError
from oed.controllers.options import Endpoint, StreamOptions
from oed.exports.simple_message import Status
from oed.exports.simple_message.kinds import MANUAL
from robots.common.arrays import Array
from robots.common.errors import InputError


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
        return getattr(status, "error", "") or f"the error {status.error_code}"
    if status.mode == MANUAL:
        return "manual mode"
    if status.drives_powered == 0:
        return "drives without power"
    if status.motion_possible == 0:
        return "that motion is not possible"
    return None


def require_known_form(options: StreamOptions, endpoint: Endpoint, positions_only: bool) -> None:
    """Refuses full points to a controller that may take short ones only, as those of ABB and Fanuc.

    Such a controller reads a full point, and a full stop, as several short points, and moves to zero.

    Args:
        options: of the stream.
        endpoint: the controller.
        positions_only: whether its feedback is JOINT_POSITION, as theirs is.

    Raises:
        InputError: full points by TCP to an unknown driver that reports positions only.
    """
    if options.driver is None and options.points == "full" and endpoint.transport == "tcp" and positions_only:
        raise InputError(
            "it is not known whether the controller takes full points: it reports positions only, as Fanuc's and ABB's "
            "drivers do, which misread full points",
            remedy="state its driver (--driver), or send short points (--points short)",
        )


def check_start(first: Array, reported: Array, tolerance: float) -> None:
    """Refuses a trajectory that begins elsewhere than the robot stands.

    Args:
        first: first point (n,) [rad or m].
        reported: positions of the robot (n,).
        tolerance: farthest distance of a joint.

    Raises:
        InputError: another pose.
    """
    away = np.abs(reported - first)
    joint = int(away.argmax())
    if away[joint] > tolerance:
        raise InputError(
            f"the robot is at {reported[joint]:.5g}, the trajectory begins at {first[joint]:.5g}",
            joint=joint + 1,
            allowed=f"a distance up to {tolerance:g}",
            remedy="move the robot to the start of the trajectory first",
        )

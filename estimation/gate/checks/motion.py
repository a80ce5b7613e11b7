"""Joints that hardly move, or stand but for a tremble."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from estimation.gate.columns import Columns
from estimation.gate.finding import Finding
from estimation.regressions.preparation import TREMBLE
from robots.robot import Robot

# A joint hardly moves below this share of its range, or of a turn. It stands where it trembles: what moves then is the
# position loop's error, by some steps of the encoder, and friction may have any value that holds the joint.
HARDLY = 0.01


def standing(robot: Robot, columns: Columns) -> NDArray[np.bool_]:
    """Tells which joints (n,) stand: nothing of their own follows from such a motion, nor from their torque.

    Args:
        robot: with n joints.
        columns: of the log.
    """
    stands: NDArray[np.bool_] = _shares(robot, columns) < TREMBLE
    return stands


def check_motion(robot: Robot, columns: Columns) -> list[Finding]:
    """Finds joints whose travel is small.

    Args:
        robot: with n joints.
        columns: of the log.
    """
    travel, share = columns.travel, _shares(robot, columns)
    if not (travel > 0).any():
        return [
            Finding(
                name="no_motion",
                severity="refuse",
                text="no joint moves",
                action="record a log in which the arm moves",
                value=0.0,
                unit="rad or m",
                column="q1",
            )
        ]
    return [
        Finding(
            name="hardly_moves",
            severity="warning",
            text=f"{robot.joint_names[joint]} moves by {travel[joint]:.3g}, {100 * share[joint]:.2g} % of its range",
            action="this log does not determine inertia and friction of this joint: move it further",
            value=float(travel[joint]),
            unit="rad or m",
            column=f"q{joint + 1}",
            joint=int(joint) + 1,
        )
        for joint in np.flatnonzero(share < HARDLY)
    ]


def _shares(robot: Robot, columns: Columns) -> NDArray[np.float64]:
    """Travel (n,) over the joints' ranges, or a turn."""
    range_ = np.asarray(robot.limits.upper) - np.asarray(robot.limits.lower)
    range_ = np.where(np.isfinite(range_), range_, 2 * np.pi)
    return np.asarray(columns.travel / np.maximum(np.minimum(range_, 2 * np.pi), 1e-12))

"""Joints that hardly move."""

from __future__ import annotations

import numpy as np

from estimation.gate.columns import Columns
from estimation.gate.finding import Finding
from robots.robot import Robot

# A joint hardly moves below this share of its range, or of a turn, ...
HARDLY = 0.01


def check_motion(robot: Robot, columns: Columns) -> list[Finding]:
    """Finds joints whose travel is small.

    Args:
        robot: with n joints.
        columns: of the log.
    """
    travel = columns.travel
    range_ = np.asarray(robot.limits.upper) - np.asarray(robot.limits.lower)
    range_ = np.where(np.isfinite(range_), range_, 2 * np.pi)
    range_ = np.minimum(range_, 2 * np.pi)
    share = travel / np.maximum(range_, 1e-12)
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
            action="inertia and friction of this joint are not to be had from this log: move it further",
            value=float(travel[joint]),
            unit="rad or m",
            column=f"q{joint + 1}",
            joint=int(joint) + 1,
        )
        for joint in np.flatnonzero(share < HARDLY)
    ]

"""Wrapped angles."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from estimation.gate.check import Check
from estimation.gate.context import Context, Stage
from estimation.gate.finding import Finding
from estimation.gate.measurements.wraps import Wraps
from robots.common.plain import several
from robots.robot import Robot


class WrappedAngles(Check):
    """Reports angles that wrap. Those of continuous joints were unwrapped; others are refused.

    All other checks see the unwrapped angles.
    """

    name: ClassVar[str] = "wrapped_angles"
    stage: ClassVar[Stage] = Stage.RECORDED
    order: ClassVar[int] = 65

    def run(self, context: Context) -> list[Finding]:
        """Reports the wraps of each joint."""
        return [_finding(context.robot, wraps) for wraps in context.recorded.wraps]


def _finding(robot: Robot, wraps: Wraps) -> Finding:
    joint, count = wraps.joint, len(wraps.rows)
    low, high = float(robot.limits.lower[joint]), float(robot.limits.upper[joint])
    endless = robot.endless[joint] and wraps.turn < 10.0
    unit = "rad" if wraps.turn < 10.0 else "degrees"
    text = f"the angle wraps {several(count, 'time')}: it jumps by {wraps.turn:.4g} ({unit})"
    if endless:
        action = "it was unwrapped, because the joint is continuous"
    elif not np.isfinite(low + high):
        action = "unwrap the angle and set its unit (deg) in a mapping (--mapping)"
    else:
        first, last = float(wraps.q.min()), float(wraps.q.max())
        shift = wraps.turn * round(0.5 * (low + high - first - last) / wraps.turn)
        action = (
            f"unwrap the angle before the log is written (numpy.unwrap, and whole turns); it then runs from "
            f"{first + shift:.4g} to {last + shift:.4g}, and the robot's description allows {low:.4g} to {high:.4g}. "
            "If the joint turns without end, describe it as continuous"
        )
    return Finding(
        name="wrapped_angle",
        severity="info" if endless else "refuse",
        text=text,
        action=action,
        value=float(count),
        unit="wraps",
        column=f"q{joint + 1}",
        joint=joint + 1,
        row=int(wraps.rows[0]) + 1,
    )

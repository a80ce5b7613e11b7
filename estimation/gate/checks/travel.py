"""Joints that hardly move."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from estimation.gate.check import Check
from estimation.gate.context import Context, Stage
from estimation.gate.finding import Finding
from estimation.gate.measurements.motion import HARDLY, travel_shares
from robots.common.plain import percent


class Travel(Check):
    """Finds joints with a small travel."""

    name: ClassVar[str] = "travel"
    stage: ClassVar[Stage] = Stage.RECORDED
    order: ClassVar[int] = 120

    def run(self, context: Context) -> list[Finding]:
        """Compares the travel of each joint with its range; the log is refused if no joint moves."""
        robot, columns = context.robot, context.recorded.columns
        travel, share = columns.travel, travel_shares(robot, columns)
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
                text=f"{robot.joint_names[joint]} moves by {travel[joint]:.3g}, {percent(share[joint])} of its range",
                action="this log does not determine inertia and friction of this joint: move it further",
                value=float(travel[joint]),
                unit="rad or m",
                column=f"q{joint + 1}",
                joint=int(joint) + 1,
            )
            for joint in np.flatnonzero(share < HARDLY)
        ]

"""Joints that are faster than their limit."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from estimation.gate.check import Check
from estimation.gate.context import Context, Stage
from estimation.gate.finding import Finding

# Speed over its limit from which it is reported.
TOO_FAST = 2.0


class Speeds(Check):
    """Finds the joint that exceeds its speed limit most: the time, or the unit of the position, may be wrong."""

    name: ClassVar[str] = "speeds"
    stage: ClassVar[Stage] = Stage.SMOOTHED
    order: ClassVar[int] = 20

    def run(self, context: Context) -> list[Finding]:
        """Compares the largest smoothed speed of each joint with its limit."""
        limit = np.asarray(context.robot.limits.velocity)
        known = np.isfinite(limit) & (limit > 0)
        if not known.any():
            return []
        peak = context.smoothed.peak_speeds
        ratio = np.where(known, peak / np.where(known, limit, 1.0), 0.0)
        worst = int(np.argmax(ratio))
        if not ratio[worst] >= TOO_FAST:
            return []
        return [
            Finding(
                name="too_fast",
                severity="warning",
                text=f"reaches a speed of {peak[worst]:.3g}, {ratio[worst]:.3g} times the limit in the robot's "
                "description",
                action="check the units of t and q, and that the log belongs to this robot",
                value=float(peak[worst]),
                unit="rad/s or m/s",
                column=f"q{worst + 1}",
                joint=worst + 1,
            )
        ]

"""Resolution of the sensors."""

from __future__ import annotations

from typing import ClassVar

from estimation.gate.check import Check
from estimation.gate.context import Context, Stage
from estimation.gate.finding import Finding
from estimation.gate.measurements.columns import Columns

# Step of a torque over its standard deviation, above which it adds to the usual noise.
COARSE_TORQUE = 0.1
# Encoder steps over the whole motion, below which velocities are coarse; a fifth of it is a warning.
COARSE_POSITION = 500


class Resolution(Check):
    """Finds positions, torques or currents with steps that are coarse for what they measure."""

    name: ClassVar[str] = "resolution"
    stage: ClassVar[Stage] = Stage.RECORDED
    order: ClassVar[int] = 60

    def run(self, context: Context) -> list[Finding]:
        """Compares the step of each column with its range or spread."""
        columns = context.recorded.columns
        joints = range(len(columns.q))
        return [finding for j in joints for finding in (*_position(columns, j), *_signal(columns, j))]


def _position(columns: Columns, joint: int) -> list[Finding]:
    step, travel = float(columns.position_steps[joint]), float(columns.travel[joint])
    if not (step > 0 and travel > 0 and travel / step < COARSE_POSITION):
        return []
    return [
        Finding(
            name="quantised_position",
            severity="warning" if travel / step < COARSE_POSITION / 5 else "info",
            text=f"coarse resolution: steps of {step:.3g}, only {travel / step:.0f} of them over the whole motion",
            action="the position is smoothed before differentiation; log positions with more digits",
            value=step,
            unit="rad or m",
            column=f"q{joint + 1}",
            joint=joint + 1,
        )
    ]


def _signal(columns: Columns, joint: int) -> list[Finding]:
    step, spread = float(columns.signal_steps[joint]), float(columns.spread[joint])
    if not step > COARSE_TORQUE * spread > 0:
        return []
    return [
        Finding(
            name="quantised_torque",
            severity="warning" if step > spread else "info",
            text=f"coarse resolution: steps of {step:.3g}, {100 * step / spread:.3g} % of its standard deviation",
            action="treated as noise; log it with more digits",
            value=step,
            unit="A" if columns.prefix == "i" else "N m or N",
            column=f"{columns.prefix}{joint + 1}",
            joint=joint + 1,
        )
    ]

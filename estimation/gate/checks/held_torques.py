"""Torques that are updated less often than the positions."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from estimation.gate.check import Check
from estimation.gate.context import Context, Stage
from estimation.gate.finding import Finding


class HeldTorques(Check):
    """Reports torques that keep each value for some rows. They are interpolated between their updates."""

    name: ClassVar[str] = "held_torques"
    stage: ClassVar[Stage] = Stage.RECORDED
    order: ClassVar[int] = 45

    def run(self, context: Context) -> list[Finding]:
        """Compares the rate of the updates with that of the rows."""
        recorded = context.recorded
        if not len(recorded.updates):
            return []
        usual = int(np.median(np.diff(recorded.updates)))
        prefix, n = recorded.columns.prefix, context.robot.n
        return [
            Finding(
                name="held_torque",
                severity="warning",
                text=f"{prefix}1 to {prefix}{n} change only in every {usual}th row "
                f"({1 / (usual * recorded.timing.period):.3g} Hz), which looks like a delay",
                action="they are interpolated between these rows; log them as often as the positions if the controller "
                "can",
                value=float(usual),
                unit="rows",
                row=int(recorded.updates[1]) + 1,
            )
        ]

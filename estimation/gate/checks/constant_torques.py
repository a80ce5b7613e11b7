"""Torques or currents that do not change."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from estimation.gate.check import Check
from estimation.gate.context import Context, Stage
from estimation.gate.finding import Finding


class ConstantTorques(Check):
    """Finds torques or currents that are constant."""

    name: ClassVar[str] = "constant_torques"
    stage: ClassVar[Stage] = Stage.RECORDED
    order: ClassVar[int] = 100

    def run(self, context: Context) -> list[Finding]:
        """Lists the constant columns; the log is refused if there are no others."""
        columns = context.recorded.columns
        if columns.signal is None:
            return []
        return [
            Finding(
                name="constant_torque",
                severity="warning" if columns.varies.any() else "refuse",
                text=f"has the constant value {columns.signal[joint, 0]:.4g}",
                action="record the torque of the moving arm, and check the meaning of the column",
                value=float(columns.signal[joint, 0]),
                unit="A" if columns.prefix == "i" else "N m or N",
                column=f"{columns.prefix}{joint + 1}",
                joint=int(joint) + 1,
            )
            for joint in np.flatnonzero(~columns.varies)
        ]

"""Columns that hung while the arm moved."""

from __future__ import annotations

from typing import ClassVar

from estimation.gate.check import Check
from estimation.gate.context import Context, Stage
from estimation.gate.finding import Finding


class StuckColumns(Check):
    """Finds columns that hold one value while the arm moves, and then jump."""

    name: ClassVar[str] = "stuck_columns"
    stage: ClassVar[Stage] = Stage.RECORDED
    order: ClassVar[int] = 50

    def run(self, context: Context) -> list[Finding]:
        """Reports the longest such run of each column."""
        return [
            Finding(
                name="stuck",
                severity="warning",
                text=f"keeps one value for {hang.rows} rows while the arm moves, and then jumps",
                action="the log is split there; repair the logger",
                value=float(hang.rows),
                unit="rows",
                column=f"{hang.prefix}{hang.joint + 1}",
                joint=hang.joint + 1,
                row=hang.first + 1,
            )
            for hang in context.recorded.hangs
        ]

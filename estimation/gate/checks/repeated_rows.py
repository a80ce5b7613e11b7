"""Rows that repeat the row before."""

from __future__ import annotations

from typing import ClassVar

from estimation.gate.check import Check
from estimation.gate.context import Context, Stage
from estimation.gate.finding import Finding

# Share of the rows in motion that repeat the row before: above the first it is reported, above the second a warning.
REPORTED, REPEATED = 1e-3, 0.02


class RepeatedRows(Check):
    """Finds rows that repeat the row before in every column while the arm moves."""

    name: ClassVar[str] = "repeated_rows"
    stage: ClassVar[Stage] = Stage.RECORDED
    order: ClassVar[int] = 40

    def run(self, context: Context) -> list[Finding]:
        """Compares their share with the limits."""
        repeated = context.recorded.repeated
        share = repeated.share
        if not share > REPORTED:
            return []
        return [
            Finding(
                name="repeated_rows",
                severity="warning" if share > REPEATED else "info",
                text=f"{100 * share:.3g} % of the rows repeat the row before while the arm moves",
                action="these rows are ignored; make the logger write each message once"
                if len(repeated.copies)
                else "repeated positions are ignored in the smoothing; make the logger write each message once",
                value=100 * share,
                unit="%",
                row=int(repeated.rows[0]) + 1,
            )
        ]

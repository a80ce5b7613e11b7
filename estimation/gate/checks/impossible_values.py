"""Values that no joint can have, in any unit."""

from __future__ import annotations

from typing import ClassVar

from estimation.gate.check import Check
from estimation.gate.context import Context, Stage
from estimation.gate.finding import Finding


class ImpossibleValues(Check):
    """Refuses a log with impossible values that are not isolated outliers."""

    name: ClassVar[str] = "impossible_values"
    stage: ClassVar[Stage] = Stage.CLEANED
    order: ClassVar[int] = 10

    def run(self, context: Context) -> list[Finding]:
        """Reports the largest value of each such column."""
        return [
            Finding(
                name="absurd_value",
                severity="refuse",
                text=f"reaches {found.value:.4g}",
                action="repair or remove these rows",
                value=found.value,
                column=f"{found.prefix}{found.joint + 1}",
                joint=found.joint + 1,
                row=found.row + 1,
            )
            for found in context.cleaned.impossible
        ]

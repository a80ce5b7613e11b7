"""Outliers in single rows."""

from __future__ import annotations

from typing import ClassVar

from estimation.gate.check import Check
from estimation.gate.context import Context, Stage
from estimation.gate.finding import Finding
from estimation.gate.measurements.outliers import are_isolated
from robots.common.plain import several


class Spikes(Check):
    """Finds outliers in positions, and in torques or currents."""

    name: ClassVar[str] = "spikes"
    stage: ClassVar[Stage] = Stage.RECORDED
    order: ClassVar[int] = 70

    def run(self, context: Context) -> list[Finding]:
        """Reports the number of outliers and the first of each column."""
        columns, outliers = context.recorded.columns, context.recorded.outliers
        findings = []
        for prefix, joint, column in columns.named():
            rows = outliers.get((prefix, joint))
            if rows is None:
                continue
            many = not are_isolated(rows, len(column))
            before, value, after = (float(column[rows[0] + k]) for k in (-1, 0, 1))
            findings.append(
                Finding(
                    name="spikes",
                    severity="refuse" if many and prefix == "q" else "warning",
                    text=f"{several(len(rows), 'outlier')}, the first with {value:.4g} between "
                    f"{before:.4g} and {after:.4g}",
                    action="too many to ignore: repair the logger" if many else "these rows are ignored",
                    value=float(len(rows)),
                    unit="rows",
                    column=f"{prefix}{joint + 1}",
                    joint=joint + 1,
                    row=int(rows[0]) + 1,
                )
            )
        return findings

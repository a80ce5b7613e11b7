"""Columns with the values of another."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from estimation.gate.check import Check
from estimation.gate.context import Context, Stage
from estimation.gate.finding import Finding

# Number of rows that are compared first: they distinguish most columns.
COMPARED_FIRST = 50


class SameColumns(Check):
    """Finds a column that is equal to another in every row. Two joints are never so alike: one column was copied."""

    name: ClassVar[str] = "same_columns"
    stage: ClassVar[Stage] = Stage.RECORDED
    order: ClassVar[int] = 110

    def run(self, context: Context) -> list[Finding]:
        """Compares each column that varies with those before it."""
        known = context.recorded.columns.named()
        varying = [(f"{prefix}{j + 1}", j, column) for prefix, j, column in known if column.min() < column.max()]
        findings = []
        for i, (name, joint, column) in enumerate(varying):
            step = max(1, len(column) // COMPARED_FIRST)
            equal = (
                other
                for other, _, values in varying[:i]
                if np.array_equal(values[::step], column[::step]) and np.array_equal(values, column)
            )
            original = next(equal, None)
            if original is not None:
                findings.append(
                    Finding(
                        name="same_column",
                        severity="warning",
                        text=f"is identical to {original} in every row",
                        action="one column was copied; the parameters of both joints are unreliable",
                        value=float(len(column)),
                        unit="rows",
                        column=name,
                        joint=joint + 1,
                    )
                )
        return findings

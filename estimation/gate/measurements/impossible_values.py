"""Values that no joint can have."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from estimation.gate.measurements.columns import Columns

# Larger absolute values are impossible in any unit: of a position, and of a torque or current.
MOST_POSITION, MOST_SIGNAL = 1e6, 1e8


@dataclass(frozen=True)
class ImpossibleValue:
    """The largest value of a column, if it is impossible.

    Attributes:
        prefix: of the column.
        joint: counted from 0.
        row: counted from 0.
        value: in the unit of the column.
    """

    prefix: str
    joint: int
    row: int
    value: float


def impossible_values(columns: Columns) -> tuple[ImpossibleValue, ...]:
    """Finds the columns with impossible values."""
    found = []
    for prefix, joint, column in columns.named():
        row = int(np.argmax(np.abs(column)))
        if abs(column[row]) > (MOST_POSITION if prefix == "q" else MOST_SIGNAL):
            found.append(ImpossibleValue(prefix, joint, row, float(column[row])))
    return tuple(found)

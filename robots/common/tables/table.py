"""A table in memory: named columns, what is known of them, and where they came from."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Column = NDArray[Any]


@dataclass(frozen=True, kw_only=True, eq=False)
class Table:
    """The columns of one file.

    Args:
        columns: the columns by name, each (N,), float64 (NaN for an empty cell) or object (text).
        metadata: what the file says of itself.
        path: the file.
        first_row: the line of the file that holds the first row of data, counted from 1; 1 for Parquet.
        units: the unit of each column that states one.
        skipped: the columns of the file that were not asked for, in order.
    """

    columns: dict[str, Column]
    metadata: dict[str, Any]
    path: Path
    first_row: int
    units: dict[str, str] = field(default_factory=dict)
    skipped: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(next(iter(self.columns.values()))) if self.columns else 0

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the columns that were read, in the order of the file."""
        return tuple(self.columns)

    def line(self, index: int) -> int:
        """Returns the line of the file, counted from 1, of a row, counted from 0."""
        return self.first_row + index

    def is_text(self, name: str) -> bool:
        """Returns whether a column holds text."""
        return bool(self.columns[name].dtype == np.dtype(object))

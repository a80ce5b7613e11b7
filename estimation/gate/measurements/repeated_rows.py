"""Rows that repeat the row before while the arm moves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimation.gate.measurements.columns import Columns
from estimation.gate.measurements.motion import moving_rows
from estimation.gate.measurements.timing import FEWEST
from robots.signals import Log

# Encoder steps per row above which a moving joint has a new position in each row.
FAST = 2.0
# Share of such rows that repeat the row before, from which they are copies: the logger samples faster than the
# controller answers. A single message that comes twice delays nothing.
COPIED = 0.1


@dataclass(frozen=True, eq=False)
class RepeatedRows:
    """Rows that are equal to the row before although the arm moves.

    Attributes:
        rows: counted from 0.
        share: of the rows in which the arm moves.
        copies: the same rows, if they hold old values with new times; none if encoder steps explain them.
    """

    rows: NDArray[np.intp]
    share: float
    copies: NDArray[np.intp]


def find_repeated_rows(log: Log, columns: Columns, moving: NDArray[np.bool_]) -> RepeatedRows:
    """Finds rows that repeat the row before in every column.

    A logger that samples faster than the controller answers writes old positions and torques with new times.

    Args:
        log: the log.
        columns: of the log.
        moving: rows in which the arm moves (N,).
    """
    none = np.zeros(0, dtype=np.intp)
    if len(log) < FEWEST:
        return RepeatedRows(none, 0.0, none)
    same = np.ones(len(log) - 1, dtype=bool)
    for _, _, values in columns.named():
        same &= values[1:] == values[:-1]
    moves = moving[1:]
    repeated = same & moves
    rows = np.flatnonzero(repeated) + 1
    share = float(repeated.sum() / max(int(moves.sum()), 1))
    if not len(rows):
        return RepeatedRows(rows, share, none)
    fast = moving_rows(log, columns, steps=FAST)[1:]
    copied = float((same & fast).sum()) > COPIED * max(int(fast.sum()), 1)
    return RepeatedRows(rows, share, rows if copied else none)

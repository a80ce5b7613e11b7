"""Torques that a controller updates less often than the positions: a staircase, which looks like a delay."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from estimation.gate.measurements.columns import Columns
from robots.signals import Log

Array = NDArray[np.float64]
Rows = NDArray[np.intp]

# Share of the updates that come as many rows after the one before as most, give or take one. A torque that repeats by
# its own resolution changes irregularly.
REGULAR = 0.9
FEWEST = 20  # updates


def find_updates(columns: Columns) -> Rows:
    """Finds the rows in which the torques or currents are updated, where others repeat them; none if all are.

    Args:
        columns: of a log.

    Returns:
        Rows (K,), counted from 0.
    """
    none = np.zeros(0, dtype=np.intp)
    if columns.signal is None or not columns.varies.any():
        return none
    changes = np.any(columns.signal[:, 1:] != columns.signal[:, :-1], axis=0)
    rows = np.flatnonzero(changes) + 1
    if len(rows) < FEWEST:
        return none
    steps = np.diff(rows)
    usual = int(np.median(steps))
    regular = float(np.mean(np.abs(steps - usual) <= (1 if usual > 2 else 0)))
    return np.union1d(0, rows) if usual > 1 and regular > REGULAR else none


def between_updates(log: Log, rows: Rows) -> Log:
    """Interpolates the torques and currents of a log linearly between the rows (K,) in which they are updated."""
    if not len(rows):
        return log

    def linear(values: Array | None) -> Array | None:
        if values is None:
            return None
        return np.column_stack([np.interp(log.t, log.t[rows], column[rows]) for column in values.T])

    return replace(log, tau=linear(log.tau), current=linear(log.current))

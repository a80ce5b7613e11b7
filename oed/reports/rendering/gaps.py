"""Pauses in a time series: the drawn line ends at a pause and begins anew after it."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from robots.common.arrays import Array

PAUSE = 5.0
"""Steps of time longer than this many usual ones are pauses; the usual step is the median."""


def break_at_pauses(t: ArrayLike, *signals: ArrayLike) -> tuple[Array, ...]:
    """Puts a NaN into each signal wherever time pauses or goes back, as between two logs.

    Args:
        t: times (N,).
        *signals: values at these times, (N,) or (N, n).

    Returns:
        Times and signals with one more row for each pause, in its middle.
    """
    times = np.asarray(t, dtype=np.float64)
    values = [np.asarray(signal, dtype=np.float64) for signal in signals]
    steps = np.diff(times)
    if not len(steps):
        return times, *values
    usual = float(np.median(steps))
    pauses = np.flatnonzero((steps > PAUSE * usual) | (steps <= 0.0)) + 1
    middle = 0.5 * (times[pauses] + times[pauses - 1])
    return np.insert(times, pauses, middle), *(np.insert(signal, pauses, np.nan, axis=0) for signal in values)

"""Time derivatives of samples."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

ENDS = 6
"""Rows at an end from which derivatives of second order in its first three rows follow."""


def differentiate(t: Array, values: Array, runs: Iterable[slice]) -> tuple[Array, Array]:
    """Computes the first and second time derivative of samples, within each log.

    It uses central differences of sixth order; near a log's ends and for uneven samples, of second order.

    Args:
        t: times (N,) [s].
        values: the samples (N, ...).
        runs: rows of each log.

    Returns:
        Both derivatives (N, ...); zero in logs of less than three rows.
    """
    first, second = np.zeros_like(values), np.zeros_like(values)
    for run in runs:
        times, x = t[run], values[run]
        if len(times) < 3:
            continue
        steps = np.diff(times)
        h = float(steps.mean())
        even = len(times) > 2 * ENDS and np.abs(steps - h).max() < 1e-3 * h
        for part in (slice(0, ENDS), slice(-ENDS, None)) if even else (slice(None),):
            slope = np.gradient(x[part], times[part], axis=0)
            first[run][part], second[run][part] = slope, np.gradient(slope, times[part], axis=0)
        if even:
            inner = slice(run.start + 3, run.stop - 3)
            a, b, c = x[4:-2] - x[2:-4], x[5:-1] - x[1:-5], x[6:] - x[:-6]
            first[inner] = (45 * a - 9 * b + c) / (60 * h)
            a, b, c = x[4:-2] + x[2:-4], x[5:-1] + x[1:-5], x[6:] + x[:-6]
            second[inner] = (270 * a - 27 * b + 2 * c - 490 * x[3:-3]) / (180 * h**2)
    return first, second

"""Positions low-passed without lag, and their derivatives."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, sosfiltfilt

Array = NDArray[np.float64]

ORDER = 8


def smoothed(x: Array, period: float, cutoffs: Array) -> tuple[Array, Array, Array]:
    """Low-passes positions (N, n) without lag and differentiates them.

    Args:
        x: positions on an even grid.
        period: of the grid [s].
        cutoffs: of each joint (n,) [Hz]; one of zero or less leaves nothing.

    Returns:
        Positions, velocities and accelerations (N, n).
    """
    q = np.zeros_like(x)
    for j, cutoff in enumerate(cutoffs):
        if cutoff <= 0:
            continue
        sections = butter(ORDER, min(cutoff * 2 * period, 0.99), output="sos")
        padding = min(len(x) - 1, round(12 / (cutoff * period)))
        q[:, j] = sosfiltfilt(sections, x[:, j], padtype="odd", padlen=padding)
    dq, ddq = differentiated(q, period)
    return q, dq, ddq


def differentiated(x: Array, period: float) -> tuple[Array, Array]:
    """Gives the first and second derivative (N, n) by central differences of sixth order, lower at the ends.

    Args:
        x: (N, n) on an even grid.
        period: of the grid [s].
    """
    first = np.gradient(x, period, axis=0, edge_order=2)
    second = np.gradient(first, period, axis=0, edge_order=2)
    if len(x) > 7:
        a, b, c = x[4:-2] - x[2:-4], x[5:-1] - x[1:-5], x[6:] - x[:-6]
        first[3:-3] = (45 * a - 9 * b + c) / (60 * period)
        a, b, c = x[4:-2] + x[2:-4], x[5:-1] + x[1:-5], x[6:] + x[:-6]
        second[3:-3] = (270 * a - 27 * b + 2 * c - 490 * x[3:-3]) / (180 * period**2)
    return first, second

"""Fewer points of a long series, with nothing lost that the eye would see: the extremes and the gaps stay."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

POINTS = 1200
"""Points per series in a page: more than a panel has pixels across."""


def thin_indices(y: ArrayLike, points: int = POINTS) -> NDArray[np.intp]:
    """Chooses samples so that the drawn line keeps its outline.

    The series is cut into equal stretches. Of each, the smallest and the largest value stay, and the first NaN, so
    that a gap stays a gap; the first and the last sample stay as well.

    Args:
        y: values, (N,), NaN where there is none.
        points: how many may stay, 6 or more.

    Returns:
        Increasing indices, at most ``points``; all N if there are no more than that.
    """
    values = np.asarray(y, dtype=np.float64)
    count = len(values)
    if count <= points:
        return np.arange(count)
    missing = np.isnan(values)
    stretches = (points - 2) // (3 if missing.any() else 2)
    edges = np.linspace(0, count, stretches + 1).astype(np.intp)
    length = int(np.diff(edges).max())
    # Stretches differ by one sample: repeating their last makes them a matrix.
    table = np.minimum(edges[:-1, None] + np.arange(length), edges[1:, None] - 1)
    low = np.where(missing, np.inf, values)[table].argmin(axis=1)
    high = np.where(missing, -np.inf, values)[table].argmax(axis=1)
    rows = np.arange(stretches)
    kept = [table[rows, low], table[rows, high], np.array([0, count - 1])]
    gaps = missing[table]
    broken = gaps.any(axis=1)
    kept.append(table[rows[broken], gaps[broken].argmax(axis=1)])
    return np.unique(np.concatenate(kept))

"""Folds of poses for cross-validation: poses that are alike stay together, so that held-out poses are others."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.cluster.hierarchy import fcluster, linkage

from robots.common.arrays import Array

ALIKE = 0.1
"""Poses are alike within so much of the range that each joint covers."""

FOLDS = 12
MOST = 1500  # poses that are compared with each other; of longer recordings, runs of neighbours are kept together


def fold_numbers(q: Array, *, folds: int = FOLDS, seed: int = 0) -> NDArray[np.int64]:
    """Assigns poses to folds, groups of like poses as a whole (blocked cross-validation, Roberts et al. 2017).

    Args:
        q: (N, n) [rad or m].
        folds: number of folds; fewer if there are fewer groups.
        seed: of the order of the groups.

    Returns:
        (N,) from 0.
    """
    groups = groups_of(q)
    sizes = np.bincount(groups)
    folds = min(folds, len(sizes))
    rng = np.random.default_rng(seed)
    order = rng.permutation(len(sizes))
    # Largest groups first, each to the fold that has least.
    order = order[np.argsort(-sizes[order], kind="stable")]
    load, numbers = np.zeros(folds), np.zeros(len(sizes), dtype=np.int64)
    for group in order:
        numbers[group] = int(np.argmin(load))
        load[numbers[group]] += sizes[group]
    return np.asarray(numbers[groups])


def groups_of(q: Array) -> NDArray[np.int64]:
    """Numbers groups of poses whose joints all lie within `ALIKE` of their ranges (N,), from 0."""
    if len(q) == 1:
        return np.zeros(1, dtype=np.int64)
    span = np.ptp(q, axis=0)
    scaled = q / np.where(span > 0.0, span, 1.0)
    if len(q) > MOST:
        return _runs(scaled)
    tree = linkage(scaled, method="complete", metric="chebyshev")
    return np.asarray(fcluster(tree, ALIKE, criterion="distance") - 1, dtype=np.int64)


def _runs(scaled: Array) -> NDArray[np.int64]:
    """Groups poses of long recordings by cells of the size `ALIKE`."""
    cells = np.floor(scaled / ALIKE).astype(np.int64)
    return np.asarray(np.unique(cells, axis=0, return_inverse=True)[1].ravel(), dtype=np.int64)


def outside_range(q: Array, fitted: Array, margin: float = 0.05) -> NDArray[np.bool_]:
    """Says which poses have a joint outside the range of those fitted.

    Args:
        q: (N, n) [rad or m].
        fitted: (M, n).
        margin: that counts as inside [rad or m].
    """
    return np.asarray(((q < fitted.min(axis=0) - margin) | (q > fitted.max(axis=0) + margin)).any(axis=1))

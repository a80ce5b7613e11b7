"""Products of groups with noise alone: what a test statistic is where no effect is there."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from estimation.diagnosis.hypothesis_tests.groups import Group
from estimation.diagnosis.hypothesis_tests.problem import Problem

Array = NDArray[np.float64]
Small = NDArray[np.float32]


def null_products(problem: Problem, groups: Sequence[Group]) -> Array:
    """Products (count, k, draws) of groups of one size on the same joints with noise that has a fit of its own.

    Args:
        problem: the whitened regression.
        groups: of as many columns each, on the same joints.

    Returns:
        One product per group, column and null log.
    """
    noise, projected = problem.nulls
    draws = projected.shape[1]
    total = -(np.concatenate([group.against for group in groups]) @ projected)
    for a, j in enumerate(groups[0].joints):
        total += np.concatenate([group.columns[a] for group in groups], axis=1).T @ noise[j]
    null = np.asarray(total.reshape(len(groups), -1, draws))
    for at, group in enumerate(groups):
        for part in group.high_band_columns:
            null[at] += _high_band_noise(part, draws)
        if group.reversal_columns is not None:
            timing = np.random.default_rng(problem.n).standard_normal((problem.n, draws))
            null[at] += group.reversal_columns.T @ timing
    return null


def _high_band_noise(columns: Small, draws: int) -> Array:
    """Products (k, draws) of columns above the band with noise: of many rows, and so as good as normal.

    The same columns meet the same noise.
    """
    gram = (columns.T @ columns).astype(float)
    values, vectors = np.linalg.eigh(gram)
    unit = np.random.default_rng(gram.ravel().view(np.uint64)).standard_normal((len(gram), draws))
    return np.asarray((vectors * np.sqrt(np.maximum(values, 0.0))) @ unit)

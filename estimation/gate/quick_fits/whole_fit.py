"""The quick fit of all joints together: how well the torques agree on the links that the joints share."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from estimation.regressions.blocks import Blocks
from robots.common.arrays import Array

# Candidates for the ridge, added to the diagonal of the Gram matrix of columns with unit length. Cross-validation
# chooses.
RIDGES = (1e-8, 1e-6, 1e-5, 1e-4, 1e-3)
# Number of times that the weights of the joints are computed from the residuals.
REWEIGHTINGS = 3
# Decrease of the held-out error (mean log) that a larger ridge must bring.
LEAST_DECREASE = 1e-3
# A joint is not identified if its held-out error is above this share of the torque's standard deviation: hardly better
# than a constant.
LIKE_A_CONSTANT = 0.9
# The same, from which a joint is poorly explained.
POORLY_EXPLAINED = 0.3


@dataclass(frozen=True, eq=False)
class WholeFit:
    """The fit of all joints at once.

    Attributes:
        unexplained: held-out error over the standard deviation of the torque (n,), NaN for a joint that is not fitted.
        by_fold: the same in each fold (n, F), NaN where it has no rows.
    """

    unexplained: Array
    by_fold: Array


def fit_all(blocks: Blocks, spread: Array, ridges: Sequence[float] = RIDGES) -> WholeFit:
    """Fits all joints together, each weighted by its residual, with the ridge that predicts held-out folds best.

    Args:
        blocks: normal equations of the joints, fold by fold.
        spread: standard deviation of the torques (n,).
        ridges: candidates, the smallest first.
    """
    total, used = blocks.total, spread > 0
    rows = np.maximum(total.count, 1)
    floor = 1e-12 * total.square / rows + np.finfo(float).tiny
    weights = np.where(used, 1.0 / np.where(used, spread, 1.0) ** 2, 0.0)
    for _ in range(REWEIGHTINGS):
        variance = np.maximum(total.residual(total.solve(weights, RIDGES[1])) / rows, floor)
        weights = np.where(used, 1.0 / variance, 0.0)
    best, lowest = np.full(blocks.square.shape, np.inf), np.inf
    scale = np.where(used, spread, np.inf)
    for candidate in ridges:
        errors = blocks.squares_by_block(blocks.without(weights, candidate, None))
        relative = np.sqrt(errors.sum(axis=1) / rows) / scale
        cost = float(np.mean(np.log(np.clip(relative[used], 1e-9, 1.0)))) if used.any() else 0.0
        if cost < lowest - LEAST_DECREASE:
            lowest, best = cost, errors
    unexplained = np.sqrt(best.sum(axis=1) / rows) / scale
    with np.errstate(invalid="ignore", divide="ignore"):
        by_fold = np.where(blocks.count > 0, np.sqrt(best / blocks.count) / scale[:, None], np.nan)
    return WholeFit(np.where(used, unexplained, np.nan), np.where(used[:, None], by_fold, np.nan))

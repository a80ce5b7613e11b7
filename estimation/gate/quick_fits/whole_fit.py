"""The quick fit of all joints together: how well the torques agree on the links that the joints share."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimation.linear_algebra.positive import solve_positive

Array = NDArray[np.float64]

# Candidates for the ridge, added to the diagonal of the Gram matrix of columns with unit length. Cross-validation
# chooses.
RIDGES = (1e-8, 1e-6, 1e-5, 1e-4, 1e-3)
# Number of times that the weights of the joints are computed from the residuals.
ROUNDS = 3
# Decrease of the held-out error (mean log) that a larger ridge must bring.
LOWER = 1e-3
# A joint is not identified if its held-out error is above this share of the torque's standard deviation: hardly better
# than a constant.
HOPELESS = 0.9
# The same, from which a joint is poorly explained.
POOR = 0.3


@dataclass(frozen=True, eq=False)
class Moments:
    """Normal equations of each joint and of each fold.

    Attributes:
        gram: (n, F, p, p).
        cross: (n, F, p).
        square: sum of squared torques (n, F).
        count: number of rows that count (n, F).
    """

    gram: Array
    cross: Array
    square: Array
    count: Array

    def scaled(self, factor: Array) -> Moments:
        """Gives the normal equations of the torques times a factor (n,)."""
        return Moments(self.gram, self.cross * factor[:, None, None], self.square * factor[:, None] ** 2, self.count)


@dataclass(frozen=True, eq=False)
class WholeFit:
    """The fit of all joints at once.

    Attributes:
        unexplained: held-out error over the standard deviation of the torque (n,), NaN for a joint that is not fitted.
        cost: mean over the joints of the log of the residual's variance.
    """

    unexplained: Array
    cost: float


def fit_all(moments: Moments, spread: Array, ridges: Sequence[float] = RIDGES) -> WholeFit:
    """Fits all joints together, each weighted by its residual, with the ridge that predicts held-out folds best.

    Args:
        moments: of the joints.
        spread: standard deviation of the torques (n,).
        ridges: candidates, the smallest first.
    """
    gram, cross, square = (array.sum(axis=1) for array in (moments.gram, moments.cross, moments.square))
    rows = np.maximum(moments.count.sum(axis=1), 1)
    floor = 1e-12 * square / rows + np.finfo(float).tiny
    used = spread > 0
    weights = np.where(used, 1.0 / np.where(used, spread, 1.0) ** 2, 0.0)
    for _ in range(ROUNDS):
        values = _System(_weighted(weights, gram), weights @ cross).solve(RIDGES[1])
        variance = np.maximum(_squares(gram, cross, square, values) / rows, floor)
        weights = np.where(used, 1.0 / variance, 0.0)
    whole, right = _weighted(weights, gram), weights @ cross
    folds = zip(_weighted(weights, moments.gram), _weighted(weights, moments.cross), strict=True)
    others = [_System(whole - own, right - its) for own, its in folds]
    best = np.full(len(spread), np.inf)
    ridge, lowest = ridges[0], np.inf
    for candidate in ridges:
        error = np.zeros(len(spread))
        for k, system in enumerate(others):
            values = system.solve(candidate)
            error += _squares(moments.gram[:, k], moments.cross[:, k], moments.square[:, k], values)
        relative = np.sqrt(error / rows) / np.where(used, spread, np.inf)
        cost = float(np.mean(np.log(np.clip(relative[used], 1e-9, 1.0)))) if used.any() else 0.0
        if cost < lowest - LOWER:
            lowest, ridge, best = cost, candidate, relative
    variance = np.maximum(_squares(gram, cross, square, _System(whole, right).solve(ridge)) / rows, floor)
    cost = float(np.mean(np.log(variance[used]))) if used.any() else 0.0
    return WholeFit(np.where(used, best, np.nan), cost)


def solve_scaled(gram: Array, cross: Array, ridge: float) -> Array:
    """Solves normal equations (p, p) and (p,) or (p, k), with a ridge for columns of unit length."""
    return _System(gram, cross).solve(ridge)


class _System:
    """Normal equations with columns of unit length, to be solved with several ridges."""

    def __init__(self, gram: Array, cross: Array) -> None:
        scale = np.sqrt(np.diag(gram))
        scale = np.where(scale > 0, scale, 1.0)
        self._scale = scale.reshape((-1,) + (1,) * (cross.ndim - 1))
        self._matrix, self._right = gram / scale[:, None] / scale, cross / self._scale
        self._diagonal = np.diag(self._matrix).copy()

    def solve(self, ridge: float) -> Array:
        """Solves them with a ridge."""
        np.fill_diagonal(self._matrix, self._diagonal + ridge)
        try:
            solved: NDArray[np.floating] = solve_positive(self._matrix, self._right)
        except np.linalg.LinAlgError:
            # The values differ by twelve orders of magnitude, and rounding has made the matrix indefinite.
            solved = np.linalg.lstsq(self._matrix, self._right, rcond=1e-9)[0]
        return np.asarray(solved / self._scale)


def _weighted(weights: Array, parts: Array) -> Array:
    """Gives the weighted sum over the joints of an array (n, ...)."""
    return np.asarray((weights @ parts.reshape(len(parts), -1)).reshape(parts.shape[1:]))


def _squares(gram: Array, cross: Array, square: Array, values: Array) -> Array:
    """Gives the sum of squared residuals of each joint (n,)."""
    return np.asarray(np.maximum(square - 2 * cross @ values + (gram @ values) @ values, 0.0))

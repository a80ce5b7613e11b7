"""When a quantity changed and by how much: a step beside a slowly varying model error."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from estimation.monitoring.control_charts.level_filter import CORRELATION_TIME
from estimation.uncertainty.quantiles import CHI2_95
from robots.common.arrays import Array


@dataclass(frozen=True, kw_only=True, eq=False)
class StepFit:
    """Steps of one quantity at every possible window.

    Attributes:
        gains: twice the gain of the log likelihood by a step that begins with each window (k,).
        sizes: of the step (k,).
        errors: standard errors of the sizes (k,).
    """

    gains: Array
    sizes: Array
    errors: Array

    def exceeding(self, margin: float) -> Array:
        """Twice the gains against steps of at most `margin` in either direction (k,); the gains of a margin of 0."""
        return (np.maximum(np.abs(self.sizes) - margin, 0.0) / self.errors) ** 2

    def best(self, first: int, last: int) -> int:
        """The window from `first` to `last`, both included, with which a step most likely begins."""
        return first + int(np.argmax(self.gains[first : last + 1]))

    def interval(self) -> tuple[int, int]:
        """The first and last window of a 95 % interval for the beginning (profile likelihood)."""
        likely = np.flatnonzero(self.gains >= self.gains.max() - CHI2_95)
        return int(likely[0]), int(likely[-1])


def fit_steps(
    t: Array,
    y: Array,
    variances: Array,
    features: Array,
    mean: Array,
    covariance: Array,
    scatter: float,
    begins: NDArray[np.intp] | None = None,
    *,
    unlogged: Array | float = 0.0,
) -> StepFit:
    """Fits y = features b + step + e + noise for a step at each window, by generalised least squares.

    Args:
        t: times of the windows (k,) [s].
        y: measured values (k,).
        variances: of their noise (k,).
        features: (k, m).
        mean: prior means of b (m,).
        covariance: of b (m, m).
        scatter: standard deviation of the model error e.
        begins: windows with which a step may begin (c,), the results are of these; all by default.
        unlogged: covariance of what unlogged work does to the values (k, k); none by default.
    """
    k = len(t)
    V = features @ covariance @ features.T
    V += scatter**2 * np.exp(-np.abs(t[:, None] - t[None, :]) / CORRELATION_TIME)
    V += unlogged
    V[np.diag_indices(k)] += variances + 1e-12 * max(float(np.trace(V)) / k, 1e-300)
    root = np.linalg.cholesky(V)
    steps = np.tril(np.ones((k, k))) if begins is None else (np.arange(k)[:, None] >= begins).astype(float)
    both = solve_triangular(root, np.column_stack([y - features @ mean, steps]), lower=True)
    r, S = both[:, 0], both[:, 1:]
    squares = (S**2).sum(axis=0)
    products = S.T @ r
    return StepFit(gains=products**2 / squares, sizes=products / squares, errors=1 / np.sqrt(squares))

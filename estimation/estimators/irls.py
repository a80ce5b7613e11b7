"""Iteratively reweighted least squares: rows that no noise explains count less, or not at all."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from functools import partial

import numpy as np

from estimation.estimators.base import Array, Solution
from estimation.estimators.wls import WeightedLeastSquares
from estimation.regressions.covariances import Equations, regressor_rows, robust_covariance
from estimation.regressions.moments import Moments
from estimation.regressions.regression_data import RegressionData
from estimation.regressions.regularisation import torque_change
from estimation.uncertainty.quantiles import robust_deviation
from robots.common.errors import InputError


class ReweightedLeastSquares(WeightedLeastSquares):
    """min sum_ij w_j rho(r_ij / s_j), s_j the residual's median absolute deviation, made consistent for normal noise.

    Solved by iterated least squares, each row weighted by rho'(u) / u (Holland and Welsch 1977). Within the joint, rows
    count by their residual; between joints as in `WeightedLeastSquares`, with s_j for the level, which outliers do not
    move.

    Args:
        tuning: multiple of s_j beyond which rows lose weight; the default keeps 95 % of least squares' efficiency
            under normal noise.
        temper: see `WeightedLeastSquares`.

    Raises:
        InputError: a tuning that is not positive.
    """

    def __init__(self, tuning: float, temper: float = 1.0) -> None:
        super().__init__(temper)
        if not (np.isfinite(tuning) and tuning > 0):
            raise InputError(f"a tuning of {tuning}", allowed="a positive number of residual levels")
        self.tuning = tuning

    @abstractmethod
    def factors(self, share: Array) -> Array:
        """Gives the weight, 0 to 1, of residuals stated as a share of tuning times scale."""

    @abstractmethod
    def slopes(self, share: Array) -> Array:
        """Gives the derivative of share times its factor."""

    def refine(self, data: RegressionData, values: Array, weights: Array) -> Solution:
        """Reweights until the parameters settle.

        The solution's `row_weights` are those of its last round, its covariance that of an M-estimate under coloured
        noise (Huber 1964): the sandwich of weighted residuals between Gram matrices that count by the slope of their
        influence. Its extras hold ``scale`` (n,) [N m or N].
        """
        values, scale = self._settle(data, values)
        joint_weights = _joint_weights(scale, self.temper)
        return Solution(
            values=values,
            weights=joint_weights,
            row_weights=partial(_row_weights, self.factors, self.tuning * scale),
            covariance=self._covariance(data, values, joint_weights, self.tuning * scale),
            extras={"scale": scale},
        )

    def _covariance(self, data: RegressionData, values: Array, weights: Array, limit: Array) -> Array:
        slope, equations = np.zeros(len(limit)), []
        for part in data.parts:
            motion = part.motion
            residual = part.tau - data.base.torque(motion.q, motion.dq, motion.ddq, values, gravity=part.gravity)
            share = residual / limit
            slope += (self.slopes(share) * (part.mask > 0)).sum(axis=0)
            regressor = partial(regressor_rows, data.base, motion, gravity=part.gravity)
            equations.append(Equations(len(motion), regressor, part.mask, residual * self.factors(share)))
        # Mean slope of the influence below which the residual has no middle.
        slope = np.maximum(slope / np.maximum(data.moments.count, 1), 0.1)
        return robust_covariance(equations, weights, np.tensordot(weights * slope, data.moments.gram, axes=1))

    def _settle(self, data: RegressionData, values: Array) -> tuple[Array, Array]:
        scale = _scale(data, values)
        for _ in range(50):
            total = _reweighted(data, values, partial(_row_weights, self.factors, self.tuning * scale))
            new = total.pulled(data.moments.pull).solve(_joint_weights(scale, self.temper), data.ridge)
            moved = torque_change(data.moments, new - values)
            values, scale = new, _scale(data, new)
            # Parameters have settled when no joint's torque moves by more than this share of its residual level.
            if (moved <= 1e-4 * scale).all():
                break
        return values, scale


class Huber(ReweightedLeastSquares):
    """rho quadratic up to the tuning and linear beyond: outliers have a bounded influence (Huber 1964)."""

    name = "huber"

    def __init__(self, tuning: float = 1.345, temper: float = 1.0) -> None:
        super().__init__(tuning, temper)

    def factors(self, share: Array) -> Array:
        """Gives min(1, 1 / |share|)."""
        return 1 / np.maximum(1.0, np.abs(share))

    def slopes(self, share: Array) -> Array:
        """Gives 1 within 1, zero beyond."""
        return (np.abs(share) <= 1).astype(float)


class Tukey(ReweightedLeastSquares):
    """Tukey's biweight: rows beyond the tuning do not count at all.

    Its cost is not convex, so it starts from Huber's solution.
    """

    name = "tukey"

    def __init__(self, tuning: float = 4.685, temper: float = 1.0) -> None:
        super().__init__(tuning, temper)

    def factors(self, share: Array) -> Array:
        """Gives (1 - share^2)^2 within 1, zero beyond."""
        return np.where(np.abs(share) < 1, (1 - share**2) ** 2, 0.0)

    def slopes(self, share: Array) -> Array:
        """Gives (1 - share^2)(1 - 5 share^2) within 1, zero beyond."""
        return np.where(np.abs(share) < 1, (1 - share**2) * (1 - 5 * share**2), 0.0)

    def refine(self, data: RegressionData, values: Array, weights: Array) -> Solution:
        """Reweights from Huber's solution on, until the parameters settle."""
        start = Huber(temper=self.temper).refine(data, values, weights)
        return super().refine(data, start.values, start.weights)


def _row_weights(factors: Callable[[Array], Array], limit: Array, residual: Array) -> Array:
    return factors(residual / limit)


def _joint_weights(scale: Array, temper: float) -> Array:
    return np.asarray(scale ** (-2 * temper))


def _reweighted(data: RegressionData, values: Array, row_weights: Callable[[Array], Array]) -> Moments:
    total: Moments | None = None
    for Y, tau, mask in data.chunks():
        root = np.sqrt(row_weights(tau - Y @ values))
        moments = Moments.of(Y * root[:, :, None], tau * root, mask)
        total = moments if total is None else total + moments
    assert total is not None
    return total


def _scale(data: RegressionData, values: Array) -> Array:
    """Median absolute residual of the rows that count, per joint (n,), over that of a unit normal."""
    residual = np.concatenate([np.where(mask > 0, np.abs(tau - Y @ values), np.nan) for Y, tau, mask in data.chunks()])
    empty = np.isnan(residual).all(axis=0)
    residual[:, empty] = 0.0
    rms = np.sqrt(data.moments.square / np.maximum(data.moments.count, 1))
    # A scale below this share of a joint's torque is rounding.
    floor = np.maximum(1e-9 * rms, np.finfo(float).tiny)
    return np.maximum(robust_deviation(residual), floor)

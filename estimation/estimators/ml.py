"""Maximum likelihood with noise that is correlated across joints."""

from __future__ import annotations

from functools import partial

import numpy as np

from estimation.estimators.base import Array, Solution
from estimation.estimators.wls import WeightedLeastSquares
from estimation.linear_algebra.scaled import inverse
from estimation.regressions.covariances import Equations, regressor_rows, robust_covariance
from estimation.regressions.regression_data import FittedRows, RegressionData
from estimation.regressions.regularisation import regularisation, solve_scaled
from robots.common.stretches import chunks


class MaximumLikelihood(WeightedLeastSquares):
    """max -N/2 log det Sigma - 1/2 sum_i (tau_i - Y_i pi)' Sigma^-1 (tau_i - Y_i pi), over pi and Sigma (n, n).

    Alternates generalised least squares and the covariance of its residual, which climbs the likelihood at every step
    (Swevers et al. 1997, with the noise's covariance estimated rather than known). A row that does not count in one
    joint enters with what the others say of it left out: that costs efficiency, and no bias.

    The solution's weights are the inverse diagonal of Sigma; its extras hold ``noise`` (n, n) [(N m)^2] and
    ``precision``, its inverse.
    """

    name = "ml"

    def __init__(self) -> None:
        super().__init__(temper=1.0)

    def refine(self, data: RegressionData, values: Array, weights: Array) -> Solution:
        """Alternates until the likelihood settles."""
        noise = _noise(data, values)
        for _ in range(20):
            precision = inverse(noise)
            values = _generalised(data, precision)
            before, noise = noise, _noise(data, values)
            level = np.sqrt(np.diag(noise))
            # The likelihood has settled when no standardised residual level moves by more.
            if np.abs((noise - before) / level[:, None] / level).max() <= 1e-6:
                break
        precision = inverse(noise)
        return Solution(
            values=values,
            weights=1 / np.diag(noise),
            covariance=_covariance(data, values, precision),
            extras={"noise": noise, "precision": precision},
        )


def _generalised(data: RegressionData, precision: Array) -> Array:
    """Solves min sum_i r_i' precision r_i, regularised as the data chose."""
    root = np.linalg.cholesky(precision).T  # precision = root' root
    size = data.base.size
    gram, cross = np.zeros((size, size)), np.zeros(size)
    for Y, tau, mask in data.chunks():
        rows = np.einsum("jk,mkb->mjb", root, Y * mask[:, :, None], optimize=True).reshape(-1, size)
        gram += rows.T @ rows
        cross += rows.T @ ((tau * mask) @ root.T).reshape(-1)
    extra, right = regularisation(data.moments, np.diag(precision), gram, data.ridge)
    return solve_scaled(gram + extra, cross + right)


def _covariance(data: RegressionData, values: Array, precision: Array) -> Array:
    """The sandwich, on rows whose noise is decorrelated across joints."""
    root = np.linalg.cholesky(precision).T
    size = data.base.size

    def whitened(part: FittedRows, start: int, stop: int) -> Array:
        Y = regressor_rows(data.base, part.motion, start, stop, part.gravity) * part.mask[start:stop, :, None]
        return np.asarray(np.einsum("jk,mkb->mjb", root, Y, optimize=True))

    gram, equations = np.zeros((size, size)), []
    for part in data.parts:
        motion = part.motion
        torque = data.base.torque(motion.q, motion.dq, motion.ddq, values, gravity=part.gravity)
        residual = (part.tau - torque) * part.mask
        rows = partial(whitened, part)
        equations.append(Equations(len(motion), rows, np.ones_like(part.mask), residual @ root.T))
        for at in chunks(len(motion)):
            flat = rows(at.start, at.stop).reshape(-1, size)
            gram += flat.T @ flat
    return robust_covariance(equations, np.ones(len(root)), gram)


def _noise(data: RegressionData, values: Array) -> Array:
    """Covariance (n, n) of the residual; each pair of joints over the rows that count in both."""
    total = both = np.zeros((len(data.moments.count),) * 2)
    for Y, tau, mask in data.chunks():
        residual = (tau - Y @ values) * mask
        total, both = total + residual.T @ residual, both + mask.T @ mask
    covariance = total / np.maximum(both, 1)
    rows = np.maximum(data.moments.count, 1)
    # Below this share of a joint's torque a residual is rounding.
    floor = 1e-6**2 * np.maximum(data.moments.square / rows, np.finfo(float).tiny)
    level = np.sqrt(np.maximum(np.diag(covariance), floor))
    correlation = covariance / level[:, None] / level
    correlation[np.diag_indices_from(correlation)] = 1.0
    # Rows that count in one joint alone can make the pairs contradict each other.
    eigenvalues, vectors = np.linalg.eigh(correlation)
    regular = (vectors * np.maximum(eigenvalues, 1e-6)) @ vectors.T
    return np.asarray(regular * level[:, None] * level)

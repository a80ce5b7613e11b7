"""How large the residual of a healthy robot is at each sample: the model's own error as a function of the motion."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

from estimation.exports.friction import linear_friction
from estimation.models.model import Model
from robots.terms.friction import SLOWEST

Array = NDArray[np.float64]

# Widths of the reversals that are compared, as shares of a joint's highest speed.
WIDTHS = np.geomspace(1e-3, 0.3, 16)
# Rounds of the weighted fit; rows that stand for a longer log.
ROUNDS, MOST_ROWS = 4, 20_000
# Smallest variance as a share of the mean one, and smallest eigenvalue of the correlation.
LEAST, DISTINCT = 1e-3, 1e-3


@dataclass(frozen=True, kw_only=True, eq=False)
class ErrorModel:
    """Variance of each joint's residual on a healthy robot, and the correlation between joints.

        var_j = level_j + reversal_j w_1^2 + friction_j w_2^2 + w_3^2 + w_4^2

    w_1 is exp(-(dq / width)^2 / 2): near a reversal friction has no sure sign. w_2 is the friction's size: its error
    grows with it. w_3 is what the parameters' errors make of a motion beyond that of any row of the fit (the band of
    `oed predict`). w_4 is coulomb / sqrt(3) at rest, for static friction is anywhere between its limits; it fades above
    the speed at which a joint stands. Each passes the observer's filter, as the residual does.

    Attributes:
        level: (n,) [(N m)^2].
        reversal: (n,) [(N m)^2].
        friction: (n,) without unit.
        width: (n,) [rad/s or m/s].
        growth: (n,) factor on the parameters' standard deviations.
        reach: (n,) largest standard deviation of a row of the fit [N m or N].
        coulomb: (n,) Coulomb friction [N m or N].
        correlation: (n, n) of the scaled residuals.
    """

    level: Array
    reversal: Array
    friction: Array
    width: Array
    growth: Array
    reach: Array
    coulomb: Array
    correlation: Array

    def amplitudes(self, dq: Array, friction: Array, variance: Array) -> Array:
        """Gives w_1 to w_4 before the filter (N, 4, n).

        Args:
            dq: velocities (N, n).
            friction: friction torque (N, n).
            variance: of the torque by the parameters' errors (N, n).
        """
        beyond = self.growth * np.sqrt(np.maximum(variance - self.reach**2, 0.0))
        holding = self.coulomb / np.sqrt(3.0) / (1.0 + (dq / SLOWEST) ** 2)
        return np.stack([reversal_amplitude(dq, self.width), np.abs(friction), beyond, holding], axis=-2)

    def deviation(self, amplitudes: Array) -> Array:
        """Gives the residual's standard deviation (N, n) [N m or N] of filtered amplitudes (N, 4, n)."""
        known = np.ones_like(self.level)
        weights = np.stack([self.reversal, self.friction, known, known])
        return np.asarray(np.sqrt(self.level + (weights * amplitudes**2).sum(axis=-2)))

    def statistic(self, residual: Array, deviation: Array) -> Array:
        """Gives the squared distance of residuals (N, n) from zero (N,), scaled and decorrelated."""
        z = residual / deviation
        return np.asarray(np.einsum("...i,ij,...j->...", z, np.linalg.inv(self.correlation), z))

    def covariance(self, deviation: Array) -> Array:
        """Gives the residual's covariance (N, n, n) [(N m)^2]."""
        return deviation[..., :, None] * self.correlation * deviation[..., None, :]

    def to_dict(self) -> dict[str, Any]:
        """Writes it as plain data."""
        return {name: np.asarray(getattr(self, name)).tolist() for name in FIELDS}

    @staticmethod
    def from_dict(data: Mapping[str, Any]) -> ErrorModel:
        """Reads what `to_dict` wrote."""
        return ErrorModel(**{name: np.array(data[name], dtype=float) for name in FIELDS})


FIELDS = ("level", "reversal", "friction", "width", "growth", "reach", "coulomb", "correlation")


def reversal_amplitude(dq: Array, width: Array) -> Array:
    """Gives w_1 of `ErrorModel` before the filter (N, n)."""
    return np.asarray(np.exp(-0.5 * (dq / width) ** 2))


def fit_error_model(
    model: Model,
    residual: Array,
    dq: Array,
    friction: Array,
    variance: Array,
    counts: NDArray[np.bool_],
    lagged: Callable[[Array], Array],
    *,
    in_fit: bool = False,
) -> ErrorModel:
    """Fits the variances to squared residuals by weighted least squares with non-negative coefficients.

    Variance-function estimation (Davidian and Carroll 1987); the width of the reversals is that of the highest Gaussian
    likelihood.

    Args:
        model: states the band by the parameters' errors.
        residual: of a healthy robot (N, n) [N m or N].
        dq: velocities (N, n).
        friction: friction torque (N, n).
        variance: of the torque by the parameters' errors (N, n).
        counts: which samples (N,) are healthy.
        lagged: the observer's filter.
        in_fit: whether the model was fitted to these logs: the parameters' errors hardly show in them, and are added at
            any motion.
    """
    n = residual.shape[1]
    growth, reach = band_parts(model)
    reach, shows = (np.zeros(n), 0.0) if in_fit else (reach, 1.0)
    friction_of = linear_friction(model)
    coulomb = np.zeros(n) if friction_of is None else friction_of.coulomb
    fastest = np.maximum(np.abs(dq).max(axis=0), np.finfo(float).tiny)
    rows = np.flatnonzero(counts)[:: max(1, int(counts.sum()) // MOST_ROWS)]
    square, ones = residual[rows] ** 2, np.ones(n)
    best, fitted = np.full(n, np.inf), np.zeros((4, n))
    trial = ErrorModel(
        level=ones,
        reversal=ones,
        friction=ones,
        width=fastest,
        growth=growth,
        reach=reach,
        coulomb=coulomb,
        correlation=np.eye(n),
    )
    w = lagged(trial.amplitudes(dq, friction, variance))[rows] ** 2
    added = w[:, 3] + shows * w[:, 2]
    for share in WIDTHS:
        near = lagged(reversal_amplitude(dq, share * fastest))[rows] ** 2
        for j in range(n):
            columns = np.column_stack([np.ones(len(rows)), near[:, j], w[:, 1, j]])
            weights, cost = _variance_fit(columns, square[:, j], added[:, j])
            if cost < best[j]:
                best[j], fitted[:, j] = cost, [*weights, share * fastest[j]]
    found = replace(trial, level=fitted[0], reversal=fitted[1], friction=fitted[2], width=fitted[3])
    w = lagged(found.amplitudes(dq, friction, variance))[rows]
    w[:, 2] *= shows
    return replace(found, correlation=_correlation(residual[rows] / found.deviation(w)))


def band_parts(model: Model) -> tuple[Array, Array]:
    """Growth and reach (n,) of a model's band; without one nothing is known beyond the fit, and nothing is added."""
    n, known = model.robot.n, model.provenance
    if "band_covariance" not in known:
        return np.zeros(n), np.zeros(n)
    return np.asarray(known["band_growth"], dtype=float), np.asarray(known["band_reach"], dtype=float)


def _variance_fit(columns: Array, square: Array, added: Array) -> tuple[Array, float]:
    """Non-negative weights (3,) of the columns beside a known variance, and the mean negative log-likelihood."""
    mean = max(float(square.mean()), np.finfo(float).tiny)
    scale = np.maximum(np.sqrt((columns**2).mean(axis=0)), np.finfo(float).tiny)
    unit, variance, weights = columns / scale, np.full(len(square), mean) + added, np.zeros(columns.shape[1])
    for _ in range(ROUNDS):
        weighted = unit / variance[:, None]
        # Three unknowns: the triangle of the rows has the same solution as the rows.
        rows = np.column_stack([weighted, (square - added) / variance])
        triangle = np.asarray(np.linalg.qr(rows, mode="r"))
        weights = nnls(triangle[:, :-1], triangle[:, -1])[0] / scale
        weights[0] = max(weights[0], LEAST * mean)
        variance = columns @ weights + added
    return weights, float(np.mean(np.log(variance) + square / variance))


def _correlation(z: Array) -> Array:
    """Correlation of scaled residuals about zero, with eigenvalues that can be inverted."""
    moments = z.T @ z / len(z)
    scale = np.sqrt(np.diag(moments))
    values, vectors = np.linalg.eigh(moments / scale[:, None] / scale)
    lifted = (vectors * np.maximum(values, DISTINCT)) @ vectors.T
    scale = np.sqrt(np.diag(lifted))
    return np.asarray(lifted / scale[:, None] / scale)

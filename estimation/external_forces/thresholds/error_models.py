"""How large the residual of a healthy robot is at each sample: the model's own error as a function of the motion."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

from estimation.exports.friction import linear_friction
from estimation.external_forces.residuals.velocity_noise import NOISE_SIGMAS, SLIDING
from estimation.models.model import Model
from robots.common.arrays import Array
from robots.common.records import Record
from robots.terms.friction import STANDING_SPEED

# Widths of the reversals that are compared, as shares of a joint's highest speed.
WIDTHS = np.geomspace(1e-3, 0.3, 16)
# Speeds [rad/s or m/s] that are compared: below such a one the sign of the friction is open.
HOLDING = (STANDING_SPEED, 2 * STANDING_SPEED, 5 * STANDING_SPEED, SLIDING)
# Seconds of new healthy motion that count as much as the fit's band of other motions. On arms that
# `benchmarks/force_motions.py` draws, the residual of motions that neither has seen is then as large as stated.
PRIOR_SECONDS = 10.0


@dataclass(frozen=True, kw_only=True, eq=False)
class ErrorModel(Record):
    """Variance of each joint's residual on a healthy robot, and the correlation between joints.

        var_j = level_j + reversal_j w_1^2 + friction_j w_2^2 + w_3^2 + w_4^2
        w_3^2 = (leverage_j + inside_j) v + beyond_j max(v - reach_j^2, 0)

    w_1 is exp(-(dq / width)^2 / 2): near a reversal friction has no sure sign. w_2 is the friction's size: its error
    grows with it. w_3 is the band of `oed predict`: v is the variance that the parameters' errors make of a motion.
    Leverage is what the healthy logs show of it. Inside and beyond are what they leave open: in motions as near to the
    fitted ones as theirs, and in others, see `fit_error_model`. w_4 is coulomb / sqrt(3) at rest, for static friction
    is anywhere between its limits; it fades above the speed of holding. Each passes the observer's filter, as the
    residual does.

    Attributes:
        level: (n,) [(N m)^2].
        reversal: (n,) [(N m)^2].
        friction: (n,) without unit.
        leverage: (n,) without unit.
        inside: (n,) without unit.
        beyond: (n,) without unit.
        reach: (n,) largest sqrt(v) in the healthy logs [N m or N].
        width: (n,) [rad/s or m/s].
        coulomb: (n,) Coulomb friction [N m or N].
        holding: (n,) speed below which the sign of the friction is open [rad/s or m/s].
        correlation: (n, n) of the scaled residuals.
    """

    level: Array
    reversal: Array
    friction: Array
    leverage: Array
    inside: Array
    beyond: Array
    reach: Array
    width: Array
    coulomb: Array
    holding: Array
    correlation: Array

    def amplitudes(self, dq: Array, friction: Array, variance: Array) -> Array:
        """Gives w_1 to w_4 before the filter (N, 4, n).

        Args:
            dq: velocities (N, n).
            friction: friction torque (N, n).
            variance: of the torque by the parameters' errors (N, n).
        """
        near, held = reversal_amplitude(dq, self.width), holding_amplitude(dq, self.coulomb, self.holding)
        return np.stack([near, np.abs(friction), self.parameter_amplitude(variance), held], axis=-2)

    def parameter_amplitude(self, variance: Array) -> Array:
        """Gives w_3 before the filter (N, n) [N m or N]."""
        known = np.maximum(variance, 0.0)
        beyond = self.beyond * np.maximum(known - self.reach**2, 0.0)
        return np.asarray(np.sqrt((self.leverage + self.inside) * known + beyond))

    @property
    def weights(self) -> Array:
        """Factors (4, n) of the squared amplitudes."""
        ones = np.ones_like(self.level)
        return np.stack([self.reversal, self.friction, ones, ones])

    @property
    def sliding(self) -> Array:
        """Speeds (n,) from which a joint surely slides [rad/s or m/s]: the level of friction is followed above them."""
        return np.maximum(SLIDING, self.holding)

    @property
    def seen(self) -> ErrorModel:
        """The same for the healthy logs themselves: what they leave open for other motions does not act in them."""
        none = np.zeros_like(self.level)
        return replace(self, inside=none, beyond=none)

    def deviation(self, amplitudes: Array) -> Array:
        """Gives the residual's standard deviation (N, n) [N m or N] of filtered amplitudes (N, 4, n)."""
        return np.asarray(np.sqrt(self.level + (self.weights * amplitudes**2).sum(axis=-2)))

    def statistic(self, residual: Array, deviation: Array) -> Array:
        """Gives the squared distance of residuals (N, n) from zero (N,), scaled and decorrelated."""
        z = residual / deviation
        return np.asarray(np.einsum("...i,ij,...j->...", z, np.linalg.inv(self.correlation), z))

    def covariance(self, deviation: Array) -> Array:
        """Gives the residual's covariance (N, n, n) [(N m)^2]."""
        return deviation[..., :, None] * self.correlation * deviation[..., None, :]


FIELDS = (
    *("level", "reversal", "friction", "leverage", "inside", "beyond", "reach"),
    *("width", "coulomb", "holding", "correlation"),
)


def reversal_amplitude(dq: Array, width: Array) -> Array:
    """Gives w_1 of `ErrorModel` before the filter (N, n)."""
    return np.asarray(np.exp(-0.5 * (dq / width) ** 2))


def holding_amplitude(dq: Array, coulomb: Array, holding: Array) -> Array:
    """Gives w_4 of `ErrorModel` before the filter (N, n) [N m or N]."""
    return np.asarray(coulomb / np.sqrt(3.0) / (1.0 + (dq / holding) ** 2))


def fit_error_model(
    model: Model,
    residual: Array,
    dq: Array,
    friction: Array,
    variance: Array,
    counts: NDArray[np.bool_],
    lagged: Callable[[Array], Array],
    *,
    seconds: float,
    velocity_noise: Array | float = 0.0,
) -> ErrorModel:
    """Fits the variances to squared residuals by weighted least squares with non-negative coefficients.

    Variance-function estimation (Davidian and Carroll 1987); the width of the reversals and the speed of holding are
    those of the highest Gaussian likelihood. Below the noise of the velocity the sign of the friction is open, whatever
    the healthy logs show: they may have no stops.

    What the fit's splits say of other motions is the growth g of the model's band: g^2 v. Where v is as in the healthy
    logs, it counts beside their residual as much as p = `PRIOR_SECONDS` do, so that inside = g^2 p / (p + seconds).
    What v has more than there counts in full: inside + beyond = g^2.

    Args:
        model: states the growth of the parameters' errors in other motions.
        residual: of a healthy robot (N, n) [N m or N].
        dq: velocities (N, n).
        friction: friction torque (N, n).
        variance: of the torque by the parameters' errors (N, n).
        counts: which samples (N,) are healthy.
        lagged: the observer's filter.
        seconds: of motion in the healthy logs that neither they nor the fit had before [s].
        velocity_noise: standard deviation of the velocities' noise (n,) [rad/s or m/s].
    """
    n = residual.shape[1]
    friction_of = linear_friction(model)
    coulomb = np.zeros(n) if friction_of is None else friction_of.coulomb
    fastest = np.maximum(np.abs(dq).max(axis=0), np.finfo(float).tiny)
    # So many rows stand for a longer log.
    rows = np.flatnonzero(counts)[:: max(1, int(counts.sum()) // 20_000)]
    square = residual[rows] ** 2
    known = np.stack([lagged(np.abs(friction))[rows] ** 2, lagged(np.sqrt(variance))[rows] ** 2])
    holding = np.maximum(np.array(HOLDING)[:, None], NOISE_SIGMAS * np.broadcast_to(velocity_noise, (n,)))
    held = [lagged(holding_amplitude(dq, coulomb, speed))[rows] ** 2 for speed in holding]
    best, fitted, slowest = np.full(n, np.inf), np.zeros((5, n)), np.zeros(n, dtype=int)
    tried = [(share, 0) for share in WIDTHS] + [(None, k) for k in range(1, len(HOLDING))]
    for share, k in tried:
        width = fitted[4] if share is None else share * fastest
        near = lagged(reversal_amplitude(dq, width))[rows] ** 2
        for j in range(n):
            columns = np.column_stack([np.ones(len(rows)), near[:, j], *known[:, :, j]])
            weights, cost = _variance_fit(columns, square[:, j], held[k][:, j])
            if cost < best[j]:
                best[j], fitted[:, j], slowest[j] = cost, [*weights, width[j]], k
    growth, share = band_growth(model) ** 2, PRIOR_SECONDS / (PRIOR_SECONDS + seconds)
    # Quantile that counts as the largest of the healthy logs.
    found = ErrorModel(
        level=fitted[0],
        reversal=fitted[1],
        friction=fitted[2],
        leverage=fitted[3],
        inside=share * growth,
        beyond=(1.0 - share) * growth,
        reach=np.sqrt(np.quantile(variance[counts], 0.999, axis=0)),
        width=fitted[4],
        coulomb=coulomb,
        holding=holding[slowest, np.arange(n)],
        correlation=np.eye(n),
    )
    w = lagged(found.seen.amplitudes(dq, friction, variance))[rows]
    return replace(found, correlation=_correlation(residual[rows] / found.seen.deviation(w)))


def band_growth(model: Model) -> Array:
    """Growth (n,) of a model's band; without one nothing is known of other motions, and nothing is added."""
    if "band_covariance" not in model.provenance:
        return np.zeros(model.robot.n)
    return np.asarray(model.provenance["band_growth"], dtype=float)


def _variance_fit(columns: Array, square: Array, added: Array) -> tuple[Array, float]:
    """Non-negative weights (4,) of the columns beside a known variance, and the mean negative log-likelihood."""
    mean = max(float(square.mean()), np.finfo(float).tiny)
    scale = np.sqrt((columns**2).mean(axis=0))
    # A narrow reversal that no sample comes near, or no errors of the parameters: such a column has no weight.
    scale = np.where(scale > np.sqrt(np.finfo(float).tiny), scale, np.inf)
    unit, variance, weights = columns / scale, np.full(len(square), mean) + added, np.zeros(columns.shape[1])
    # Rounds of the weighted fit.
    for _ in range(4):
        weighted = unit / variance[:, None]
        # Four unknowns: the triangle of the rows has the same solution as the rows.
        rows = np.column_stack([weighted, (square - added) / variance])
        triangle = np.asarray(np.linalg.qr(rows, mode="r"))
        weights = nnls(triangle[:, :-1], triangle[:, -1])[0] / scale
        # Smallest variance, as a share of the mean one.
        weights[0] = max(weights[0], 1e-3 * mean)
        variance = columns @ weights + added
    return weights, float(np.mean(np.log(variance) + square / variance))


def _correlation(z: Array) -> Array:
    """Correlation of scaled residuals about zero, with eigenvalues that can be inverted."""
    moments = z.T @ z / len(z)
    scale = np.sqrt(np.diag(moments))
    values, vectors = np.linalg.eigh(moments / scale[:, None] / scale)
    # Smallest eigenvalue of the correlation.
    lifted = (vectors * np.maximum(values, 1e-3)) @ vectors.T
    scale = np.sqrt(np.diag(lifted))
    return np.asarray(lifted / scale[:, None] / scale)

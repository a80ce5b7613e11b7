"""One window: its residual projected onto friction, offset and payload, with standard errors under coloured noise."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimation.linear_algebra.scaled import inverse
from estimation.monitoring.windows.baseline import Directions
from estimation.uncertainty.autoregressive import autocovariance, levinson, whitened
from estimation.uncertainty.quantiles import NORMAL_MEDIAN
from robots.common.arrays import Array

WINDOW_NOISE_ORDER = 12
# Rows below this share of the usual speed say more of presliding than of friction.
SLIDING_SPEED_SHARE = 0.03


@dataclass(frozen=True, kw_only=True, eq=False)
class Window:
    """What one window says.

    Attributes:
        t: mean time [s].
        start: of the window [s].
        end: of the window [s].
        values: friction over the model's (n,), offsets (n,) [N m or N], payload (p,).
        covariance: of the values.
        determined: which values the window determines.
        power: mean power of the model's friction (n,) [W].
        friction_rms: of the model's friction (n,) [N m or N].
        torque_rms: of the measured torque (n,) [N m or N].
        residual_rms: of the residual after the projection (n,) [N m or N].
        spread: standard deviation of the measured torque (n,) [N m or N].
        burst: largest chi-square of the whitened residual in a block.
        burst_at: time of that block [s].
        burst_joints: whitened residual of each joint in it (n,).
        burst_scatter: that of all blocks (n,), one for noise: more where the model errs on this motion.
        colour: autocovariances of the residual (n, lags + 1); zero for a joint that rests throughout.
        rows: rows behind them (n,).
    """

    t: float
    start: float
    end: float
    values: Array
    covariance: Array
    determined: NDArray[np.bool_]
    power: Array
    friction_rms: Array
    torque_rms: Array
    residual_rms: Array
    spread: Array
    burst: float
    burst_at: float
    burst_joints: Array
    burst_scatter: Array
    colour: Array
    rows: Array

    @property
    def moves(self) -> NDArray[np.bool_]:
        """Joints that move for some time in the window (n,); the others have no residual."""
        return np.asarray(self.colour[:, 0] > np.finfo(float).tiny)

    def residual_variance(self, joint: int) -> float:
        """Returns the variance of the log of a joint's residual RMS, for coloured noise (Bartlett 1946).

        Args:
            joint: counted from 0, one that moves.
        """
        correlation = self.colour[joint] / self.colour[joint, 0]
        return float((2 * correlation @ correlation - 1) / (2 * self.rows[joint]))


@dataclass(frozen=True, eq=False)
class Colour:
    """Each joint's noise as an autoregressive process.

    Attributes:
        coefficients: per joint (p_j,).
        variances: of the innovations (n,); NaN of a joint whose noise is not known yet.
    """

    coefficients: tuple[Array, ...]
    variances: Array

    @classmethod
    def fit(cls, covariances: Array, rows: Array) -> Colour:
        """Fits processes to autocovariances (n, lags + 1) over `rows` (n,)."""
        fits = [levinson(c, max(float(r), 2.0), 2) for c, r in zip(covariances, rows, strict=True)]
        return cls(tuple(a for a, _ in fits), np.array([variance for _, variance in fits]))

    def of(self, known: NDArray[np.bool_]) -> Colour:
        """The processes of some joints (n,) only."""
        return Colour(self.coefficients, np.where(known, self.variances, np.nan))

    def completed(self, other: Colour) -> Colour:
        """Takes those of another one where the noise is not known."""
        unknown = np.isnan(self.variances)
        pairs = zip(unknown, self.coefficients, other.coefficients, strict=True)
        return Colour(
            tuple(theirs if missing else own for missing, own, theirs in pairs),
            np.where(unknown, other.variances, self.variances),
        )


def project(
    t: Array,
    dq: Array,
    tau: Array,
    directions: Directions,
    *,
    colour: Colour | None,
    expected: Array,
    usual_speed: Array,
    edges: tuple[float, float],
) -> Window:
    """Fits friction factors, offsets and a payload to a window by generalised least squares.

    Args:
        t: times (N,) [s], even.
        dq: velocities (N, n).
        tau: torques (N, n) [N m or N].
        directions: the model's torques.
        colour: of the noise; None where it is not known: then the window's own, from a first fit. Likewise of a joint
            whose noise is not known: one that has rested so far.
        expected: friction factors that are expected (n,).
        usual_speed: highest usual speed (n,) [rad/s or m/s].
        edges: start and end of the window [s].
    """
    n = tau.shape[1]
    y = tau - directions.rest
    live = np.abs(dq) >= SLIDING_SPEED_SHARE * usual_speed
    scale = np.sqrt(np.mean(tau**2, axis=0))
    if colour is None or np.isnan(colour.variances).any():
        plain = Colour((np.zeros(0),) * n, np.maximum((0.1 * scale) ** 2, np.finfo(float).tiny))
        values, _, _ = _solve(y, directions, live, plain, expected, scale)
        own = Colour.fit(*_colour(y - _fitted(values, directions), live))
        colour = own if colour is None else colour.completed(own)
    values, covariance, prior = _solve(y, directions, live, colour, expected, scale)
    residual = y - _fitted(values, directions)
    covariances, rows = _colour(residual, live)
    at, burst, joints, scatter = _burst(t, residual, live, colour)
    # A quantity whose prior is hardly narrowed is not determined by the window.
    return Window(
        t=float(t.mean()),
        start=edges[0],
        end=edges[1],
        values=values,
        covariance=covariance,
        determined=np.diag(covariance) < 0.5**2 * prior,
        power=np.maximum((directions.friction * dq).mean(axis=0), 0.0),
        friction_rms=np.sqrt(np.mean(directions.friction**2, axis=0)),
        torque_rms=scale,
        residual_rms=np.sqrt(covariances[:, 0]),
        spread=tau.std(axis=0),
        burst=burst,
        burst_at=at,
        burst_joints=joints,
        burst_scatter=scatter,
        colour=covariances,
        rows=rows,
    )


def _fitted(values: Array, directions: Directions) -> Array:
    n = directions.friction.shape[1]
    return directions.friction * values[:n] + values[n : 2 * n] + directions.payload @ values[2 * n :]


def _solve(
    y: Array, directions: Directions, live: NDArray[np.bool_], colour: Colour, expected: Array, scale: Array
) -> tuple[Array, Array, Array]:
    """Values, covariance and prior variances."""
    n, p = y.shape[1], directions.payload.shape[2]
    size = 2 * n + p
    level = max(float(np.sqrt(np.mean(scale**2))), np.finfo(float).tiny)
    payload_rms = np.sqrt(np.mean(directions.payload**2, axis=(0, 1))) if p else np.zeros(0)
    prior = np.concatenate(
        [np.ones(n), np.maximum(scale, 1e-9) ** 2, (level / np.maximum(payload_rms, 1e-9 * level)) ** 2]
    )
    mean = np.concatenate([expected, np.zeros(n + p)])
    H = np.diag(1.0 / prior)
    g = mean / prior
    for j in range(n):
        a = colour.coefficients[j]
        columns = np.column_stack([directions.friction[:, j], np.ones(len(y)), directions.payload[:, j, :], y[:, j]])
        white = whitened(columns, a)
        chosen = _usable(live[:, j], len(a))
        white = white[chosen]
        X, target = white[:, :-1], white[:, -1]
        index = np.concatenate([[j, n + j], np.arange(2 * n, size)]).astype(int)
        H[np.ix_(index, index)] += X.T @ X / colour.variances[j]
        g[index] += X.T @ target / colour.variances[j]
    covariance = inverse(H)
    return covariance @ g, covariance, prior


def _usable(live: NDArray[np.bool_], order: int) -> NDArray[np.bool_]:
    """Rows whose filtered value rests on rows in motion: not the first ones, and none just after a reversal."""
    still = np.concatenate([[0], np.cumsum(~live)])
    index = np.arange(len(live))
    begin = np.maximum(index - order, 0)
    return (index >= order) & (still[index + 1] - still[begin] == 0)


def _colour(residual: Array, live: NDArray[np.bool_]) -> tuple[Array, Array]:
    rows = np.maximum(live.sum(axis=0), 1).astype(float)
    found = autocovariance(np.where(live, residual, 0.0), rows, WINDOW_NOISE_ORDER)
    found[:, 0] = np.maximum(found[:, 0], np.finfo(float).tiny)
    return found, rows


def _burst(t: Array, residual: Array, live: NDArray[np.bool_], colour: Colour) -> tuple[float, float, Array, Array]:
    """The block with the largest whitened residual.

    Returns:
        Its time, chi-square over the joints and each joint's value (n,), and the scatter of all blocks (n,).
    """
    n = residual.shape[1]
    white = np.zeros_like(residual)
    for j, a in enumerate(colour.coefficients):
        filtered = whitened(residual[:, j], a)
        chosen = _usable(live[:, j], len(a))
        # The sum of whitened values over the root of their number is normal for noise, and large for a short force.
        white[chosen, j] = filtered[chosen] / np.sqrt(colour.variances[j])
    # A short force is looked for in blocks of this time [s].
    length = max(1, round(0.2 / float(t[1] - t[0])))
    count = len(t) // length
    if count == 0:
        return float(t[0]), 0.0, np.zeros(n), np.ones(n)
    sums = white[: count * length].reshape(count, length, n).sum(axis=1) / np.sqrt(length)
    chi = (sums**2).sum(axis=1)
    worst = int(np.argmax(chi))
    # Of the median: a short force fills few blocks.
    scatter = np.sqrt(np.maximum(np.median(sums**2, axis=0) / NORMAL_MEDIAN**2, 1.0))
    return float(t[min(worst * length + length // 2, len(t) - 1)]), float(chi[worst]), sums[worst], scatter

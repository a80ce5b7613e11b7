"""Delay of each joint's torque behind its motion, to a part of a sample."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimation.gate.quick_fits.joint_fit import OWN_RIDGE, JointFit, Rows
from estimation.linear_algebra.scaled import solve_ridge
from estimation.uncertainty.blocks import correlated_errors
from robots.common.arrays import Array

# Delays up to so many samples or so many seconds are tried, whichever is longer.
SAMPLES, SECONDS = 8.0, 0.04
# Held-out error over the torque's standard deviation from which delays so many times longer are tried as well.
UNEXPLAINED, LONGER = 0.15, 12.0
# Step between delays that are tried, in periods of the cut-off, and limits of the number of steps to either side.
STEP, FEWEST_STEPS, MOST_STEPS = 0.06, 6, 60
# Rows from which the search starts; then all rows are used near the best delay.
ROWS = 3000
# Share of a joint's RMS speed between which a reversal is timed.
REVERSING = 0.05


@dataclass(frozen=True)
class Delay:
    """The delay of one joint.

    Attributes:
        value: by which the torque is logged after the position that belongs to it [s].
        error: standard error [s]; infinite if the best delay is the longest that was tried.
        saved: share of the unexplained torque that the delay explains.
        sticks: time for which the joint stands at a reversal [s]. Its friction changes in this time, so that a delay
            as short is none.
    """

    value: float
    error: float
    saved: float
    sticks: float


def usual_delay(period: float) -> float:
    """Gives the longest usual delay [s] at a sample period [s]."""
    return max(SAMPLES * period, SECONDS)


def estimate_delays(
    rows: Rows, fits: Mapping[int, JointFit], period: float, cutoff: float, unexplained: Array
) -> list[Delay | None]:
    """Finds for each joint the delay at which its torque fits the motion best.

    Args:
        rows: the excerpts.
        fits: of the joints to look at, counted from 0.
        period: [s].
        cutoff: of the smoothing [Hz].
        unexplained: held-out errors over the torques' standard deviations, without a delay (n,).

    Returns:
        The delays (n,), None of joints without a fit.
    """
    delays: list[Delay | None] = [None] * len(unexplained)
    for factor in (1.0, LONGER):
        chosen = {j: fit for j, fit in fits.items() if (LONGER if unexplained[j] > UNEXPLAINED else 1.0) == factor}
        if not chosen:
            continue
        reach = usual_delay(period) * factor
        half = int(np.clip(np.ceil(reach * cutoff / STEP), FEWEST_STEPS, MOST_STEPS))
        search = _Search(rows, chosen, np.linspace(-reach, reach, 2 * half + 1))
        for joint, fit in chosen.items():
            delays[joint] = _refined(rows, fit, joint, search)
    return delays


class _Search:
    """Fits of the torques of some joints, shifted in time.

    Args:
        rows: the excerpts.
        fits: of the joints, counted from 0.
        shifts: delays that are tried (S,) [s], zero in the middle.
    """

    def __init__(self, rows: Rows, fits: Mapping[int, JointFit], shifts: Array) -> None:
        self._rows, self._fits, self.shifts = rows, fits, shifts
        self._known: dict[int, dict[int, float]] = {}
        stride = max(1, len(rows.q) // ROWS)
        kept = rows.thinned(stride)
        self._starts = {}
        for joint, fit in fits.items():
            counted = fit.counted[kept]
            Y, tau = rows.joints[joint].Y[kept[counted]], rows.near_torques(shifts, joint, stride)[:, counted]
            tau -= tau.mean(axis=1, keepdims=True)
            cross, square = Y.T @ tau.T, np.einsum("st,st->s", tau, tau)
            left = square - np.einsum("ks,ks->s", cross, solve_ridge(Y.T @ Y, cross, OWN_RIDGE))
            self._starts[joint] = int(np.argmin(left / np.maximum(square, 1e-300)))

    def error(self, joint: int, k: int) -> float:
        """Gives the share of a joint's variance that is left at the k-th shift, from all rows."""
        if k not in self._known:
            tau = self._rows.torques(float(self.shifts[k]))
            self._known[k] = {j: _remaining(fit, tau[fit.counted, j]) for j, fit in self._fits.items()}
        return self._known[k][joint]

    def best(self, joint: int) -> int:
        """Gives the shift at which least is left, from all rows; the search starts at the best from some of them."""
        last = len(self.shifts) - 1
        k = self._starts[joint]
        while True:
            around = range(max(k - 1, 0), min(k + 1, last) + 1)
            lowest = min(around, key=lambda place: self.error(joint, place))
            if lowest == k:
                return k
            k = lowest


def sticking_time(rows: Rows, joint: int) -> float:
    """Gives the median time [s] for which a joint sticks at its reversals, zero without any.

    It is the time below a speed, extrapolated to a speed of zero by that below twice the speed. A stop for a while is
    no reversal.

    Args:
        rows: the excerpts.
        joint: counted from 0.
    """
    excess, first = [], 0
    for part in rows.excerpts:
        at = slice(first, first + len(part.t))
        v, rest = rows.dq[at, joint], rows.rest[at, joint]
        first += len(part.t)
        turns = np.flatnonzero((v[:-1] * v[1:] < 0) & ~rest[1:])
        below, twice = (_lengths(np.abs(v) < k * REVERSING * rows.speed[joint], turns) for k in (1, 2))
        excess += ((2 * below - twice) * float(np.median(np.diff(part.t)))).tolist()
    return max(float(np.median(excess)), 0.0) if excess else 0.0


def _lengths(slow: NDArray[np.bool_], places: NDArray[np.intp]) -> NDArray[np.intp]:
    """Gives the number of rows of the slow stretch around each place; zero where it is not slow."""
    fast = np.concatenate([[-1], np.flatnonzero(~slow), [len(slow)]])
    after = np.searchsorted(fast, places)
    return np.asarray(np.where(slow[places], fast[after] - fast[after - 1] - 1, 0))


def _refined(rows: Rows, fit: JointFit, joint: int, search: _Search) -> Delay:
    """Interpolates the best delay between those that were tried, and gives its standard error."""
    shifts, best = search.shifts, search.best(joint)
    half, sticks = len(shifts) // 2, sticking_time(rows, joint)
    zero = search.error(joint, half)
    if best in (0, 2 * half):
        left = search.error(joint, best)
        return Delay(float(shifts[best]), np.inf, float(1 - left / zero) if zero > 0 else 0.0, sticks)
    left, middle, right = (search.error(joint, place) for place in (best - 1, best, best + 1))
    bend = left - 2 * middle + right
    value = float(shifts[best] + 0.5 * (left - right) / bend * (shifts[1] - shifts[0])) if bend > 0 else shifts[best]
    # Gauss-Newton at the optimum gives the standard error, block by block.
    rate, tau = rows.torques(value, 1)[fit.counted, joint], rows.torques(value)[fit.counted, joint]
    slope = rate - fit.Y @ (fit.inverse @ (fit.Y.T @ rate))
    residual = tau - fit.Y @ (fit.inverse @ (fit.Y.T @ tau))
    scores = rows.block_sums(slope * residual, fit.counted)
    curvature = float(slope @ slope)
    error = float(correlated_errors(scores)) / curvature if curvature > 0 else np.inf
    return Delay(value, error, float(1 - np.sqrt(_remaining(fit, tau) / zero)) if zero > 0 else 0.0, sticks)


def _remaining(fit: JointFit, tau: Array) -> float:
    """Gives the share of the torque's variance that the fit leaves."""
    tau = tau - tau.mean()
    cross, square = fit.Y.T @ tau, float(tau @ tau)
    return float(square - cross @ (fit.inverse @ cross)) / max(square, 1e-300)

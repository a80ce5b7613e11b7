"""Delay of the torque behind the position, which a fit would take for damping and friction."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimation.gate.finding import Finding
from estimation.gate.quick_fits.joint_fit import OWN_RIDGE, JointFit, Rows
from estimation.gate.quick_fits.whole_fit import solve_scaled

Array = NDArray[np.float64]

# Delays looked for: up to so many samples, or so many seconds, either way, whichever is longer.
SAMPLES, SECONDS = 8.0, 0.04
# Where much of the torque is unexplained without, longer ones are tried as well.
UNEXPLAINED, LONGER = 0.15, 12.0
# They are tried in steps of this share of the smoothing's period, on some rows first and about the best then on all.
STEP, ROWS = 0.06, 3000
# A delay counts when it is so many standard errors long, ...
SURE = 4.0
# ... and matters when it is longer than this share of a sample, and takes this share of the unexplained torque away; of
# a delay longer than usual, which friction with memory or an elastic joint may imitate: half.
LONG, WORTH, WORTH_LONG = 0.5, 0.15, 0.5
# Two joints' delays agree within this share of a sample, this share of the delay, or three standard errors.
AGREE, AGREE_SHARE = 0.5, 0.2


@dataclass(frozen=True)
class Delay:
    """The delay of one joint.

    Attributes:
        value: by which the torque is logged after the position that belongs to it [s].
        error: standard error [s].
        saved: share of the unexplained torque that vanishes with it.
    """

    value: float
    error: float
    saved: float


def estimate_delays(
    rows: Rows, fits: Mapping[int, JointFit], period: float, cutoff: float, unexplained: Array
) -> list[Delay | None]:
    """Finds for each joint the delay at which the torque fits the motion best, to a part of a sample.

    Args:
        rows: the excerpts.
        fits: of the joints to look at, counted from 0.
        period: [s].
        cutoff: of the smoothing [Hz].
        unexplained: torque errors over the torques' standard deviations, without a delay (n,).

    Returns:
        The delays (n,), None of joints without a fit.
    """
    delays: list[Delay | None] = [None] * len(unexplained)
    for factor in (1.0, LONGER):
        chosen = {j: fit for j, fit in fits.items() if (LONGER if unexplained[j] > UNEXPLAINED else 1.0) == factor}
        if not chosen:
            continue
        reach = max(SAMPLES * period, SECONDS) * factor
        half = int(np.clip(np.ceil(reach * cutoff / STEP), 6, 60))
        search = _Search(rows, chosen, np.linspace(-reach, reach, 2 * half + 1))
        for joint, fit in chosen.items():
            delays[joint] = _refined(rows, fit, joint, search)
    return delays


class _Search:
    """Torques at many shifts against the motion, of some joints.

    Args:
        rows: the excerpts.
        fits: of the joints, counted from 0.
        shifts: that are tried (S,) [s], zero in the middle.
    """

    def __init__(self, rows: Rows, fits: Mapping[int, JointFit], shifts: Array) -> None:
        self._rows, self._fits, self.shifts = rows, fits, shifts
        self._known: dict[int, dict[int, float]] = {}
        stride = max(1, len(rows.q) // ROWS)
        kept = rows.thinned(stride)
        self._starts = {}
        for joint, fit in fits.items():
            Y, tau = fit.Y[kept], rows.near_torques(shifts, joint, stride)
            tau -= tau.mean(axis=1, keepdims=True)
            cross, square = Y.T @ tau.T, np.einsum("st,st->s", tau, tau)
            left = square - np.einsum("ks,ks->s", cross, solve_scaled(Y.T @ Y, cross, OWN_RIDGE))
            self._starts[joint] = int(np.argmin(left / np.maximum(square, 1e-300)))

    def error(self, joint: int, k: int) -> float:
        """Share of a joint's variance that is left at the k-th shift, by all rows."""
        if k not in self._known:
            tau = self._rows.torques(float(self.shifts[k]))
            self._known[k] = {j: _remaining(fit, tau[:, j]) for j, fit in self._fits.items()}
        return self._known[k][joint]

    def best(self, joint: int) -> int:
        """The shift at which least is left, by all rows: found from the best by some of them, step by step."""
        last = len(self.shifts) - 1
        k = self._starts[joint]
        while True:
            around = range(max(k - 1, 0), min(k + 1, last) + 1)
            lowest = min(around, key=lambda place: self.error(joint, place))
            if lowest == k:
                return k
            k = lowest


def _refined(rows: Rows, fit: JointFit, joint: int, search: _Search) -> Delay:
    """The delay between the shifts that were tried, with its standard error."""
    shifts, best = search.shifts, search.best(joint)
    half = len(shifts) // 2
    zero = search.error(joint, half)
    if best in (0, 2 * half):
        left = search.error(joint, best)
        return Delay(float(shifts[best]), np.inf, float(1 - left / zero) if zero > 0 else 0.0)
    left, middle, right = (search.error(joint, place) for place in (best - 1, best, best + 1))
    bend = left - 2 * middle + right
    value = float(shifts[best] + 0.5 * (left - right) / bend * (shifts[1] - shifts[0])) if bend > 0 else shifts[best]
    # Gauss-Newton at the optimum gives the standard error, block by block.
    rate, tau = rows.torques(value, 1)[:, joint], rows.torques(value)[:, joint]
    slope = rate - fit.Y @ (fit.inverse @ (fit.Y.T @ rate))
    residual = tau - fit.Y @ (fit.inverse @ (fit.Y.T @ tau))
    scores = np.add.reduceat(slope * residual, rows.starts)
    curvature = float(slope @ slope)
    error = float(np.sqrt(scores @ scores)) / curvature if curvature > 0 else np.inf
    return Delay(value, error, float(1 - np.sqrt(_remaining(fit, tau) / zero)) if zero > 0 else 0.0)


def delay_findings(delays: list[Delay | None], period: float) -> list[Finding]:
    """Judges the delays (n,): one finding where the joints agree, else one per joint."""
    significant = {
        joint: delay
        for joint, delay in enumerate(delays, start=1)
        if delay is not None
        and np.isfinite(delay.error)
        and abs(delay.value) > max(SURE * delay.error, LONG * period)
        and (delay.saved > WORTH if abs(delay.value) <= max(SAMPLES * period, SECONDS) else _shared(delay, delays))
    }
    # A delay common to all joints can be detected at a shorter value than one of a single joint.
    known = [
        delay
        for delay in delays
        if delay is not None and delay.error < max(0.5 * period, AGREE_SHARE * abs(delay.value))
    ]
    if len(known) > 1 and 2 * len(known) >= len(delays):
        weights = np.array([1.0 / max(delay.error, 1e-3 * period) ** 2 for delay in known])
        mean = float(weights @ [delay.value for delay in known] / weights.sum())
        error = float(1 / np.sqrt(weights.sum()))
        alike = all(
            abs(delay.value - mean) < max(3 * delay.error, AGREE * period, AGREE_SHARE * abs(mean)) for delay in known
        )
        if alike and abs(mean) > max(LONG * period, SURE * error):
            return [_finding(mean, error, None, period, len(known))]
    return [_finding(delay.value, delay.error, joint, period, 1) for joint, delay in significant.items()]


def _shared(long: Delay, delays: list[Delay | None]) -> bool:
    """Whether a long delay saves much, and no other joint is known to be without it: it comes from the whole logger."""
    others = [delay for delay in delays if delay is not None and delay.error < 0.25 * abs(long.value)]
    return long.saved > WORTH_LONG and all(abs(delay.value - long.value) < 0.25 * abs(long.value) for delay in others)


def _finding(value: float, error: float, joint: int | None, period: float, joints: int) -> Finding:
    who = f"the torques of {joints} joints" if joint is None else "the torque"
    verb = ("lag" if value > 0 else "lead") + ("" if joint is None else "s")
    return Finding(
        name="delay",
        severity="warning" if abs(value) > period else "info",
        text=f"{who} {verb} the position by {1e3 * abs(value):.3g} ms ({abs(value) / period:.2g} samples, "
        f"standard error {1e3 * error:.2g} ms)",
        action="a delay distorts friction and damping: log position and torque on one clock, or shift the torque",
        value=value,
        unit="s",
        joint=joint,
    )


def _remaining(fit: JointFit, tau: Array) -> float:
    """Share of the torque's variance that the fit leaves."""
    tau = tau - tau.mean()
    cross, square = fit.Y.T @ tau, float(tau @ tau)
    return float(square - cross @ (fit.inverse @ cross)) / max(square, 1e-300)

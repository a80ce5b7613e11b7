"""Repeated motion: its period, found from positions alone and sharper than a sample."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from robots.common.stretches import spans

Array = NDArray[np.float64]

# Two passes of one motion by one controller differ by less than this share of the joint's spread.
ALIKE = 0.02
# Before it returns, the motion must have been this far away (mean square over twice the variance).
AWAY = 0.25
# Share of the log that must repeat.
MOST = 0.6
# Rows at which lags are compared first.
COARSE = 6000
SHORTEST = 0.5  # [s]
# A harmonic counts where its power is this much above its error.
STANDS_OUT = 4.0


@dataclass(frozen=True)
class Cycle:
    """A stretch of a log in which one motion repeats.

    Attributes:
        start: first row.
        stop: row after the last whole period.
        period: [s].
        count: whole periods P.
    """

    start: int
    stop: int
    period: float
    count: int


def find_cycle(q: Array, step: float) -> Cycle | None:
    """Finds the shortest period that most of a log repeats.

    The mean square of q(t + L) - q(t) over all lags L comes from one Fourier transform; the lag where it first returns
    to nothing is looked at sample by sample, and made sharper than a sample by the parabola through its neighbours.

    Args:
        q: positions (N, n) on a uniform grid [rad or m].
        step: of the grid [s].

    Returns:
        The cycle; None where nothing repeats.
    """
    spread = q.std(axis=0)
    moving = spread > 1e-3 * max(float(spread.max()), 1e-9)
    if not moving.any() or len(q) * step < 2 * SHORTEST:
        return None
    x = (q[:, moving] - q[:, moving].mean(axis=0)) / spread[moving]
    stride = max(1, len(x) // COARSE)
    for lag in _candidate_lags(x[::stride], stride * step):
        cycle = _examine(x, lag * stride, stride, step)
        if cycle is not None:
            return cycle
    return None


def _candidate_lags(x: Array, step: float) -> list[int]:
    """Lags at which the motion comes back after it had been away, the shortest first."""
    difference = _difference(x)
    shortest, longest = max(2, round(SHORTEST / step)), len(x) // 2 + 1
    away = np.maximum.accumulate(difference)
    lags = np.arange(1, len(difference) - 1)
    dips = (difference[1:-1] <= difference[:-2]) & (difference[1:-1] < difference[2:])
    found = lags[dips & (difference[1:-1] < AWAY) & (away[1:-1] > AWAY)]
    found = found[(found >= shortest) & (found <= longest)]
    return [int(lag) for lag in found[:20]]


def _difference(x: Array) -> Array:
    """Mean over rows and joints of (x(t + L) - x(t))^2 / 2, for all lags L up to just over half the length."""
    rows = len(x)
    spectrum = np.fft.rfft(x, 2 * rows, axis=0)
    product = np.fft.irfft(np.abs(spectrum) ** 2, axis=0)[: rows // 2 + 2].sum(axis=1)
    energy = np.concatenate([[0.0], np.cumsum((x**2).sum(axis=1))])
    lags = np.arange(len(product))
    both = energy[rows - lags] + energy[rows] - energy[lags]
    result: Array = (both - 2 * product) / (2 * x.shape[1] * (rows - lags))
    return result


def _examine(x: Array, lag: int, reach: int, step: float) -> Cycle | None:
    """Looks at one lag at full rate: where it holds, and how long exactly the period is."""
    fine = np.arange(max(1, lag - 2 * reach), min(len(x) - 2, lag + 2 * reach) + 1)
    costs = np.array([_mismatch(x, int(candidate), 8) for candidate in fine])
    best = int(fine[costs.argmin()])
    alike = np.abs(x[best:] - x[:-best]).max(axis=1) < ALIKE + _slack(x, step)
    start, stop = _longest(alike)
    if stop - start < 0.8 * best or (stop - start + best) < MOST * len(x):
        return None
    part = x[start : stop + best]
    periods = max(1, (len(part) - 1) // best)
    length = _sharp(part, best)
    for multiple in range(2, periods):
        # Ever more passes apart, the same error of the lag weighs less.
        length = _sharp(part, round(length * multiple)) / multiple
    count = int(np.floor(len(part) / length + 1e-6))
    if count < 2:
        return None
    return Cycle(start, min(start + round(count * length), len(x)), length * step, count)


def _slack(x: Array, step: float) -> float:
    """What half a sample of lag may make of the positions."""
    return float(np.abs(np.diff(x, axis=0)).max())


def _mismatch(x: Array, lag: int, stride: int = 1) -> float:
    return float(np.mean((x[lag:][::stride] - x[:-lag][::stride]) ** 2))


def _sharp(x: Array, lag: int) -> float:
    """Minimises the mismatch about a lag by a parabola, in samples."""
    if not 2 <= lag < len(x) - 2:
        return float(lag)
    before, here, after = (_mismatch(x, lag + offset) for offset in (-1, 0, 1))
    curvature = before - 2 * here + after
    if curvature <= 0:
        return float(lag)
    return lag + float(np.clip(0.5 * (before - after) / curvature, -1.0, 1.0))


def _longest(flags: NDArray[np.bool_]) -> tuple[int, int]:
    return max(spans(flags), key=lambda span: span[1] - span[0], default=(0, 0))


def project_on_harmonics(q: Array, step: float, cycle: Cycle) -> tuple[tuple[Array, Array, Array], Array, Array]:
    """Projects the repeated rows on the harmonics that stand out of what changes from period to period.

    Args:
        q: positions (N, n) on the grid.
        step: of the grid [s].
        cycle: where it repeats.

    Returns:
        q, dq and ddq (stop - start, n) of the cycle's rows, free of noise; the highest frequency kept (n,) [Hz]; the
        power density of the noise that the mean over repetitions still has there (n,).
    """
    rows = np.arange(cycle.start, cycle.stop)
    times = (rows - cycle.start) * step
    samples = max(8, round(cycle.period / step))
    grid = cycle.period / samples * np.arange(samples * cycle.count)
    grid = grid[grid <= times[-1] + 0.5 * step]
    part = CubicSpline(times, q[rows])(grid)
    whole = len(part) // samples
    passes = np.fft.rfft(part[: whole * samples].reshape(whole, samples, -1), axis=1) / samples
    mean = passes.mean(axis=0)  # (H, n)
    scatter = (np.abs(passes - mean) ** 2).sum(axis=0) / max(whole - 1, 1) / whole
    # Neighbouring harmonics share a noise level: few periods tell little of one.
    scatter = _averaged(scatter)
    # An encoder that rounds each pass alike makes errors that repeat: what the top of the band holds is no motion.
    top = slice(-max(4, len(mean) // 4), None)
    scatter = np.maximum(scatter, np.median(np.abs(mean[top]) ** 2, axis=0))
    kept = mean * np.clip(1.0 - scatter / np.maximum(np.abs(mean) ** 2, 1e-300), 0.0, 1.0)
    lost = _first_lost(np.abs(mean) ** 2 > STANDS_OUT * scatter)
    kept[lost[None, :] <= np.arange(len(kept))[:, None]] = 0.0
    kept[0] = mean[0]
    omega = 2 * np.pi / cycle.period * np.arange(len(kept))[:, None]
    signals = [np.fft.irfft(kept * factor * samples, samples, axis=0) for factor in (1.0, 1j * omega, -(omega**2))]
    knots = cycle.period / samples * np.arange(samples + 1)
    phase = np.mod(times, cycle.period)
    closed = [CubicSpline(knots, np.vstack([s, s[:1]]), bc_type="periodic")(phase) for s in signals]
    return (closed[0], closed[1], closed[2]), lost / cycle.period, 2 * cycle.period * np.median(scatter[top], axis=0)


def _averaged(power: Array, width: int = 15) -> Array:
    padded = np.pad(power, ((width // 2, width // 2), (0, 0)), mode="edge")
    sums = np.cumsum(np.vstack([np.zeros((1, power.shape[1])), padded]), axis=0)
    return (sums[width:] - sums[:-width]) / width


def _first_lost(stands_out: NDArray[np.bool_], allowed: int = 3) -> NDArray[np.intp]:
    """Per joint the harmonic after which more than `allowed` in a row do not stand out (n,)."""
    count, joints = stands_out.shape
    result = np.full(joints, count)
    for j in range(joints):
        silent = 0
        for h in range(1, count):
            silent = 0 if stands_out[h, j] else silent + 1
            if silent > allowed:
                result[j] = h - allowed
                break
    return result

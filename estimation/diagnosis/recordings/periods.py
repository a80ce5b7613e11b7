"""Periodic motion: its period to a fraction of a sample, and the projection on its harmonics."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from estimation.uncertainty.correlations import squared_differences
from robots.common.stretches import spans

Array = NDArray[np.float64]

# Two passes of one motion differ by less than this share of the joint's standard deviation.
ALIKE = 0.02
# Mean square distance, over twice the variance, that the motion must reach before it returns.
AWAY = 0.25
# Share of the log that must repeat.
MOST = 0.6
# Number of rows of the first, coarse comparison of lags.
COARSE = 6000
SHORTEST = 0.5  # [s] shortest period
# Power over its error from which a harmonic is significant.
STANDS_OUT = 4.0


@dataclass(frozen=True)
class Cycle:
    """A stretch of a log in which a motion repeats.

    Attributes:
        start: first row.
        stop: row after the last whole period.
        period: period [s].
        count: number of whole periods P.
    """

    start: int
    stop: int
    period: float
    count: int


def find_cycle(q: Array, step: float) -> Cycle | None:
    """Finds the shortest period that most of a log repeats.

    One Fourier transform yields the mean square of q(t + L) - q(t) for all lags L. The lag at which it first returns to
    zero is then examined sample by sample. Parabolas through neighbouring lags refine it to a fraction of a sample.

    Args:
        q: positions (N, n) on a uniform grid [rad or m].
        step: sample period of the grid [s].

    Returns:
        The cycle; None if nothing repeats.
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
    """Returns the lags at which the motion returns after it moved away, the shortest first."""
    # For lags up to just over half the length.
    difference = 0.5 * squared_differences(x, x, np.arange(len(x) // 2 + 2)).mean(axis=1)
    shortest, longest = max(2, round(SHORTEST / step)), len(x) // 2 + 1
    away = np.maximum.accumulate(difference)
    lags = np.arange(1, len(difference) - 1)
    dips = (difference[1:-1] <= difference[:-2]) & (difference[1:-1] < difference[2:])
    found = lags[dips & (difference[1:-1] < AWAY) & (away[1:-1] > AWAY)]
    found = found[(found >= shortest) & (found <= longest)]
    return [int(lag) for lag in found[:20]]


def _examine(x: Array, lag: int, reach: int, step: float) -> Cycle | None:
    """Examines one lag at the full rate: where the motion repeats, and with which period."""
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
        # An error of the lag is divided by the number of passes between the rows compared.
        length = _sharp(part, round(length * multiple)) / multiple
    count = int(np.floor(len(part) / length + 1e-6))
    if count < 2:
        return None
    return Cycle(start, min(start + round(count * length), len(x)), length * step, count)


def _slack(x: Array, step: float) -> float:
    """Returns the largest change of the positions per row, which bounds the effect of a lag rounded to whole rows."""
    return float(np.abs(np.diff(x, axis=0)).max())


def _mismatch(x: Array, lag: int, stride: int = 1) -> float:
    return float(np.mean((x[lag:][::stride] - x[:-lag][::stride]) ** 2))


def _sharp(x: Array, lag: int) -> float:
    """Returns the lag of least mismatch near a given lag, in samples, by a parabola."""
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
    """Projects the periodic rows on the harmonics that exceed the variation between periods.

    Args:
        q: positions (N, n) on the grid [rad or m].
        step: sample period of the grid [s].
        cycle: the rows that repeat.

    Returns:
        q, dq and ddq (stop - start, n) in the rows of the cycle, with noise removed; the highest frequency kept (n,)
        [Hz]; the power density of the noise that remains in the mean over repetitions (n,) [rad^2/Hz or m^2/Hz].
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
    # Average over neighbouring harmonics: few periods determine the noise of a single one poorly.
    scatter = _averaged(scatter)
    # An encoder rounds each pass alike, so that its errors repeat. The upper end of the band contains no motion and
    # shows them.
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
    """Returns per joint (n,) the harmonic from which on more than `allowed` in a row are not significant."""
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

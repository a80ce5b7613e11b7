"""Periodic motion: where in a log it repeats, and its period to a fraction of a sample."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimation.uncertainty.correlations import squared_differences
from robots.common.arrays import Array
from robots.common.stretches import spans

SHORTEST_MOTION_PERIOD = 0.5  # [s] shortest period


@dataclass(frozen=True)
class Cycle:
    """A stretch of a log in which a motion repeats.

    Attributes:
        start: first row.
        stop: row after the last whole period.
        period: period [s].
        count: number of whole periods P.
        whole: whether the motion repeats all through the log.
    """

    start: int
    stop: int
    period: float
    count: int
    whole: bool = False


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
    if not moving.any() or len(q) * step < 2 * SHORTEST_MOTION_PERIOD:
        return None
    x = (q[:, moving] - q[:, moving].mean(axis=0)) / spread[moving]
    # Number of rows of the first, coarse comparison of lags.
    stride = max(1, len(x) // 6000)
    for lag in _candidate_lags(x[::stride], stride * step):
        cycle = _examine(x, lag * stride, stride, step)
        if cycle is not None:
            return cycle
    return None


def _candidate_lags(x: Array, step: float) -> list[int]:
    """Returns the lags at which the motion returns after it moved away, the shortest first."""
    # For lags up to just over half the length.
    difference = 0.5 * squared_differences(x, x, np.arange(len(x) // 2 + 2)).mean(axis=1)
    shortest, longest = max(2, round(SHORTEST_MOTION_PERIOD / step)), len(x) // 2 + 1
    away = np.maximum.accumulate(difference)
    lags = np.arange(1, len(difference) - 1)
    dips = (difference[1:-1] <= difference[:-2]) & (difference[1:-1] < difference[2:])
    # Mean square distance, over twice the variance, that the motion must reach before it returns.
    far = 0.25
    found = lags[dips & (difference[1:-1] < far) & (away[1:-1] > far)]
    found = found[(found >= shortest) & (found <= longest)]
    return [int(lag) for lag in found[:20]]


def _examine(x: Array, lag: int, reach: int, step: float) -> Cycle | None:
    """Examines one lag at the full rate: where the motion repeats, and with which period."""
    fine = np.arange(max(1, lag - 2 * reach), min(len(x) - 2, lag + 2 * reach) + 1)
    costs = np.array([_mismatch(x, int(candidate), 8) for candidate in fine])
    best = int(fine[costs.argmin()])
    # Two passes of one motion differ by less than this share of the joint's standard deviation.
    alike = np.abs(x[best:] - x[:-best]).max(axis=1) < 0.02 + _slack(x, step)
    start, stop = _longest(alike)
    # Share of the log that must repeat.
    if stop - start < 0.8 * best or (stop - start + best) < 0.6 * len(x):
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
    return Cycle(start, min(start + round(count * length), len(x)), length * step, count, bool(alike.all()))


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

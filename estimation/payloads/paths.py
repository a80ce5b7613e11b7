"""Whether two logs follow one path, and which of their rows belong together."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from estimation.uncertainty.correlations import squared_differences
from robots.common.arrays import Array

Indices = NDArray[np.intp]

# Aligned logs have this share of the shorter one in common.
LEAST_OVERLAP = 0.5


@dataclass(frozen=True, eq=False)
class PathMatch:
    """Two logs laid over each other in time.

    Attributes:
        shift: time of the second log minus that of the first at the same place of the path [s].
        first: rows of the first log (M,) that have a partner.
        second: their partners (M,) in the second log.
        distance: RMS distance of each joint (n,) over the paired rows [rad or m].
        largest: largest distance of each joint (n,) [rad or m].
        same: whether the logs follow one path.
    """

    shift: float
    first: Indices
    second: Indices
    distance: Array
    largest: Array
    same: bool


def match_paths(t1: Array, q1: Array, t2: Array, q2: Array) -> PathMatch:
    """Finds the shift in time by which two logs agree best, and pairs their rows by it.

    Args:
        t1: times (N,) of the first log [s].
        q1: positions (N, n) [rad or m].
        t2: times (M,) of the second.
        q2: positions (M, n).

    Returns:
        The match; its `same` is False where the paths differ.
    """
    # Logs are aligned on a grid of 0.02 s or coarser.
    grid = max(float(np.median(np.diff(t1))), float(np.median(np.diff(t2))), 0.02)
    # Joints of two logs that are this close have the same position [rad or m].
    same_position = 0.01
    scale = np.maximum(np.maximum(np.ptp(q1, axis=0), np.ptp(q2, axis=0)), same_position)
    coarse = [_on_grid(t, q / scale, grid) for t, q in ((t1, q1), (t2, q2))]
    shift = t2[0] - t1[0] + grid * _coarse_shift(*coarse)

    def distance(extra: float) -> float:
        at = t1 + shift + extra
        inside = (at >= t2[0]) & (at <= t2[-1])
        if not inside.any():
            return float("inf")
        other = np.column_stack([np.interp(at[inside], t2, column) for column in q2.T])
        return float((((q1[inside] - other) / scale) ** 2).sum(axis=1).mean())

    found = minimize_scalar(distance, bounds=(-grid, grid), method="bounded", options={"xatol": 1e-5})
    shift = shift + float(found.x) if found.fun < distance(0.0) else shift
    first, second = _pairs(t1 + shift, t2)
    if not len(first):
        return PathMatch(shift, first, second, scale, scale, False)
    # The distance at the same time, not at the nearest sample: half a period of motion is no other path.
    at = t1[first] + shift
    apart = q1[first] - np.column_stack([np.interp(at, t2, column) for column in q2.T])
    rms = np.sqrt((apart**2).mean(axis=0))
    span = np.maximum(np.ptp(q1[first], axis=0), np.ptp(q2[second], axis=0))
    enough = len(first) >= LEAST_OVERLAP * min(len(t1), len(t2))
    # Logs are of one path where no joint's RMS distance exceeds 2 % of its range, or 0.01 rad or m.
    same = bool(enough and (rms <= np.maximum(0.02 * span, same_position)).all())
    return PathMatch(shift, first, second, rms, np.abs(apart).max(axis=0), same)


def _on_grid(t: Array, q: Array, grid: float) -> Array:
    at = np.arange(t[0], t[-1], grid)
    return np.column_stack([np.interp(at, t, column) for column in q.T])


def _coarse_shift(a: Array, b: Array) -> int:
    """The number of rows by which b is later than a, where both agree best."""
    middle = a.mean(axis=0)
    a, b = a - middle, b - middle
    least = max(1, int(LEAST_OVERLAP * min(len(a), len(b))))
    shifts = np.arange(least - len(a), len(b) - least + 1)
    rows = np.minimum(len(b), len(a) + shifts) - np.maximum(shifts, 0)
    mean = np.maximum(squared_differences(b, a, shifts).sum(axis=1), 0.0)
    # Shifts whose distance is this close to the best, in units of the motion's variance, are alike; the longest overlap
    # among them counts. A periodic motion has many.
    alike = mean <= mean.min() + 1e-4 * float((a**2).sum(axis=1).mean())
    return int(shifts[np.argmax(np.where(alike, rows, -1))])


def _pairs(times: Array, others: Array) -> tuple[Indices, Indices]:
    """Pairs each time of the sparser log with the nearest of the denser one."""
    if len(others) < 2 or len(times) < 2:
        return np.zeros(0, dtype=np.intp), np.zeros(0, dtype=np.intp)
    dense = np.median(np.diff(others)) <= np.median(np.diff(times)) * 1.001
    if not dense:
        second, first = _pairs(others, times)
        return first, second
    right = np.clip(np.searchsorted(others, times), 1, len(others) - 1)
    nearest = np.where(times - others[right - 1] <= others[right] - times, right - 1, right)
    # Rows that are paired are at most so many periods apart.
    near = np.abs(others[nearest] - times) <= 0.75 * float(np.median(np.diff(others)))
    return np.flatnonzero(near).astype(np.intp), nearest[near].astype(np.intp)

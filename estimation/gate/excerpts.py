"""Stretches of a log that stand for all of it, smoothed and thinned: what a quick fit needs of millions of rows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.signal import sosfiltfilt

from estimation.preprocessing.smoothing import butterworth
from robots.signals import Log

Array = NDArray[np.float64]

# Rows of the log that are looked at, and into how many stretches they are spread where the log is longer.
ROWS, STRETCHES = 24_000, 12
# Cut-offs of the smoothing to choose from [Hz], up to this share of the sampling rate.
CUTOFFS, NYQUIST_SHARE = (1.5, 3.0, 6.0, 12.0, 24.0), 0.25
# Samples kept per period of the cut-off.
KEPT = 5.0
# Of the smoothing: order of each pass, and what it forgets at the ends, in periods of the cut-off.
ORDER, EDGE = 3, 0.35


@dataclass(frozen=True, eq=False)
class Excerpt:
    """One stretch, on an even grid.

    Attributes:
        t: (M,) [s].
        q: (M, n), smoothed.
        dq: (M, n).
        ddq: (M, n).
        torque: smoothed torque or current as a function of time, (n,) values; None without.
        raw: torque or current as it was logged (M, n).
        column: the log's own velocities, smoothed alike (M, n); None without.
    """

    t: Array
    q: Array
    dq: Array
    ddq: Array
    torque: CubicSpline | None
    raw: Array | None
    column: Array | None

    def thinned(self, stride: int) -> Excerpt:
        """Keeps every so many rows."""
        kept: dict[str, Any] = {
            name: None if array is None else array[::stride]
            for name in ("t", "q", "dq", "ddq", "raw", "column")
            for array in [getattr(self, name)]
        }
        return replace(self, **kept)


def cutoffs(period: float) -> tuple[float, ...]:
    """The cut-offs [Hz] that a sample period [s] allows, the lowest first."""
    highest = NYQUIST_SHARE / period
    return tuple(cutoff for cutoff in CUTOFFS if cutoff <= highest) or (highest,)


def stretches(parts: Sequence[tuple[int, int]]) -> list[slice]:
    """Chooses evenly spread rows, some `ROWS` in all, as slices that cross no gap.

    Args:
        parts: (first, stop) of the stretches without a gap.
    """
    total = sum(stop - first for first, stop in parts)
    if total <= ROWS:
        return [slice(first, stop) for first, stop in parts]
    length = ROWS // STRETCHES
    chosen = []
    for centre in (np.arange(STRETCHES) + 0.5) * total / STRETCHES:
        # The place counted over all parts, found in its own part and moved off its ends.
        passed = 0
        for first, stop in parts:
            if centre < passed + stop - first:
                begin = int(np.clip(first + centre - passed - length / 2, first, max(first, stop - length)))
                chosen.append(slice(begin, min(begin + length, stop)))
                break
            passed += stop - first
    return chosen


def excerpt(log: Log, torque: Array | None, piece: slice, period: float, cutoff: float) -> Excerpt | None:
    """Smooths one stretch, position and torque by the same filter, and thins it.

    Args:
        log: the log.
        torque: (N, n), or None.
        piece: the rows.
        period: median step of the log [s].
        cutoff: [Hz].

    Returns:
        The stretch without its ends; None where too little is left.
    """
    t, q = log.t[piece], log.q[piece]
    duration = float(t[-1] - t[0])
    grid = t[0] + period * np.arange(int(duration / period + 1e-6) + 1)
    if len(grid) < 24:
        return None
    # Messages that came twice: the position of the later one is old.
    fresh = np.concatenate([[True], np.any(q[1:] != q[:-1], axis=1)])
    uneven = np.abs(np.diff(t) - period).max() > 0.02 * period
    if uneven or not fresh.all():
        fresh = fresh if fresh.sum() > 0.5 * len(t) else np.ones(len(t), dtype=bool)
        q = _at(grid, t[fresh], q[fresh])
        tau = None if torque is None else _at(grid, t, torque[piece])
        velocity = None if log.dq is None else _at(grid, t, log.dq[piece])
    else:
        grid, tau = t, None if torque is None else torque[piece]
        velocity = None if log.dq is None else log.dq[piece]
    q = _low_pass(q, period, cutoff)
    dq = np.gradient(q, period, axis=0, edge_order=2)
    ddq = np.gradient(dq, period, axis=0, edge_order=2)
    edge = EDGE / cutoff
    inside = np.flatnonzero((grid >= grid[0] + edge) & (grid <= grid[-1] - edge))
    inside = inside[:: max(1, int(1.0 / (KEPT * cutoff * period)))]
    if len(inside) < 12:
        return None
    spline = None if tau is None else CubicSpline(grid, _low_pass(tau, period, cutoff))
    return Excerpt(
        grid[inside],
        q[inside],
        dq[inside],
        ddq[inside],
        spline,
        None if tau is None else tau[inside],
        None if velocity is None else _low_pass(velocity, period, cutoff)[inside],
    )


def _at(grid: Array, t: Array, values: Array) -> Array:
    return np.column_stack([np.interp(grid, t, column) for column in values.T])


def _low_pass(x: Array, period: float, cutoff: float) -> Array:
    own = min(cutoff / (np.sqrt(2) - 1) ** (1 / (2 * ORDER)), 0.45 / period)
    padding = int(min(len(x) - 1, max(3 * (2 * ORDER + 1), round(2 / (cutoff * period)))))
    sections = butterworth(ORDER, 2 * own * period)
    return np.asarray(sosfiltfilt(sections, x, axis=0, padtype="odd", padlen=padding))

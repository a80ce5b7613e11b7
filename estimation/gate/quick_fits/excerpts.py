"""Stretches of a log that stand for all of it, smoothed and thinned: what a quick fit needs of millions of rows."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
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
class Stretch:
    """Some rows of a log on an even grid, as they were recorded.

    Attributes:
        t: (N,) [s].
        q: (N, n).
        torque: torque or current (N, n); None without.
        velocity: the log's own (N, n); None without.
    """

    t: Array
    q: Array
    torque: Array | None
    velocity: Array | None

    @property
    def signals(self) -> list[Array]:
        """Those that there are, in order."""
        return [signal for signal in (self.q, self.torque, self.velocity) if signal is not None]


@dataclass(frozen=True, eq=False)
class Excerpt:
    """One stretch, smoothed and thinned.

    Attributes:
        t: (M,) [s].
        q: (M, n), smoothed.
        dq: (M, n).
        ddq: (M, n).
        raw: torque or current as it was logged (M, n); None without.
        column: the log's own velocities, smoothed alike (M, n); None without.
        place: (M,) of the thinned rows on the grid.
        grid: all of the stretch's times (N,) [s].
        smoothed: torque or current on the grid, smoothed (N, n); None without.
    """

    t: Array
    q: Array
    dq: Array
    ddq: Array
    raw: Array | None
    column: Array | None
    place: NDArray[np.intp]
    grid: Array
    smoothed: Array | None

    def thinned(self, stride: int) -> Excerpt:
        """Keeps every so many rows."""
        kept: dict[str, Any] = {
            name: None if array is None else array[::stride]
            for name in ("t", "q", "dq", "ddq", "raw", "column", "place")
            for array in [getattr(self, name)]
        }
        return replace(self, **kept)

    def torque_at(self, t: Array, order: int = 0) -> Array:
        """Smoothed torque or current (K, n) at times (K,), within the stretch, or its derivative of some order."""
        if t is self.t and not order and self.smoothed is not None:
            return self.smoothed[self.place]
        return np.asarray(self._spline(np.clip(t, self.grid[0], self.grid[-1]), order))

    def torque_near(self, shift: Array, joint: int, stride: int) -> Array:
        """Smoothed torque or current of a joint so much later (S,) [s], between the samples by straight lines.

        Args:
            shift: (S,) [s].
            joint: counted from 0.
            stride: every so many rows.

        Returns:
            (S, M / stride); at the ends the last sample.
        """
        assert self.smoothed is not None
        samples = shift * (len(self.grid) - 1) / (self.grid[-1] - self.grid[0])
        whole = np.floor(samples)
        part = (samples - whole)[:, None]
        before = self.place[None, ::stride] + whole.astype(np.intp)[:, None]
        column = np.ascontiguousarray(self.smoothed[:, joint])
        return column.take(before, mode="clip") * (1 - part) + column.take(before + 1, mode="clip") * part

    @cached_property
    def _spline(self) -> CubicSpline:
        # Few excerpts of those that are tried are ever asked for it.
        assert self.smoothed is not None
        return CubicSpline(self.grid, self.smoothed)


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


def stretch(log: Log, torque: Array | None, piece: slice, period: float) -> Stretch | None:
    """Puts some rows on an even grid.

    Args:
        log: the log.
        torque: (N, n), or None.
        piece: the rows.
        period: median step of the log [s].

    Returns:
        The stretch; None where too little is left.
    """
    t, q = log.t[piece], log.q[piece]
    duration = float(t[-1] - t[0])
    grid = t[0] + period * np.arange(int(duration / period + 1e-6) + 1)
    if len(grid) < 24:
        return None
    tau, velocity = (None if values is None else values[piece] for values in (torque, log.dq))
    # Messages that came twice: the position of the later one is old.
    fresh = np.concatenate([[True], np.any(q[1:] != q[:-1], axis=1)])
    uneven = np.abs(np.diff(t) - period).max() > 0.02 * period
    if not uneven and fresh.all():
        return Stretch(t, q, tau, velocity)
    fresh = fresh if fresh.sum() > 0.5 * len(t) else np.ones(len(t), dtype=bool)
    tau, velocity = (None if values is None else _at(grid, t, values) for values in (tau, velocity))
    return Stretch(grid, _at(grid, t[fresh], q[fresh]), tau, velocity)


def excerpts_of(parts: Sequence[Stretch], period: float, cutoff: float) -> tuple[Excerpt, ...]:
    """Smooths stretches, position and torque by the same filter, and thins them.

    Args:
        parts: the stretches, of the same signals.
        period: of their grids [s].
        cutoff: [Hz].

    Returns:
        The stretches without their ends, but for those of which too little is left.
    """
    smoothed: dict[int, Iterator[Array]] = {}
    for length in {len(part.t) for part in parts}:
        # One filter for all signals of all stretches of a length: its set-up costs as much as a column.
        signals = [signal for part in parts if len(part.t) == length for signal in part.signals]
        widths = np.cumsum([signal.shape[1] for signal in signals])
        smoothed[length] = iter(np.split(_low_pass(np.hstack(signals), period, cutoff), widths[:-1], axis=1))
    found = (_excerpt(part, [next(smoothed[len(part.t)]) for _ in part.signals], period, cutoff) for part in parts)
    return tuple(part for part in found if part is not None)


def _excerpt(part: Stretch, smoothed: Sequence[Array], period: float, cutoff: float) -> Excerpt | None:
    """Thins one stretch whose signals are smoothed; None where too little is left."""
    grid, edge = part.t, EDGE / cutoff
    inside = np.flatnonzero((grid >= grid[0] + edge) & (grid <= grid[-1] - edge))
    inside = inside[:: max(1, int(1.0 / (KEPT * cutoff * period)))]
    if len(inside) < 12:
        return None
    smooth = iter(smoothed)
    q = next(smooth)

    def slope(at: NDArray[np.intp]) -> Array:
        return np.asarray((q[at + 1] - q[at - 1]) / (2 * period))

    tau = None if part.torque is None else next(smooth)
    return Excerpt(
        grid[inside],
        q[inside],
        slope(inside),
        # The ends that are left out are longer than a sample by far.
        (slope(inside + 1) - slope(inside - 1)) / (2 * period),
        None if part.torque is None else part.torque[inside],
        None if part.velocity is None else next(smooth)[inside],
        inside,
        grid,
        tau,
    )


def _at(grid: Array, t: Array, values: Array) -> Array:
    return np.column_stack([np.interp(grid, t, column) for column in values.T])


def _low_pass(x: Array, period: float, cutoff: float) -> Array:
    own = min(cutoff / (np.sqrt(2) - 1) ** (1 / (2 * ORDER)), 0.45 / period)
    padding = int(min(len(x) - 1, max(3 * (2 * ORDER + 1), round(2 / (cutoff * period)))))
    sections = butterworth(ORDER, 2 * own * period)
    return np.asarray(sosfiltfilt(sections, x, axis=0, padtype="odd", padlen=padding))

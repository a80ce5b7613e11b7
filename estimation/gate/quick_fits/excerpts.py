"""Excerpts of a log, smoothed and thinned: a quick fit needs few of millions of rows."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from estimation.preprocessing import rows_at_rest
from estimation.preprocessing.smoothing import differentiate, low_pass
from robots.common.arrays import Array
from robots.signals import Log

# Most rows of a log that are used, and number of stretches to which they are distributed in a longer log.
ROWS, STRETCHES = 24_000, 12
# Candidates for the cut-off of the smoothing [Hz], and the highest over the sampling rate.
CUTOFFS, NYQUIST_SHARE = (1.5, 3.0, 6.0, 12.0, 24.0), 0.25
# Samples kept per period of the cut-off.
KEPT = 5.0
# Fewest samples of a stretch before and after it is smoothed and thinned.
FEWEST_SAMPLES, FEWEST_KEPT = 24, 12
# Deviation of the time steps from the median, over it, from which a stretch is interpolated on an even grid.
UNEVEN = 0.02
# Share of rows with a new position from which repeated positions are left out of the interpolation.
FRESH = 0.5
# Length of the smoothing's inaccurate ends in periods of the cut-off.
EDGE = 0.35


@dataclass(frozen=True, eq=False)
class Stretch:
    """Some rows of a log on an even grid, not smoothed.

    Attributes:
        t: (N,) [s].
        q: positions (N, n).
        torque: torque or current (N, n); None without.
        velocity: the log's own (N, n); None without.
    """

    t: Array
    q: Array
    torque: Array | None
    velocity: Array | None

    @property
    def signals(self) -> list[Array]:
        """Positions, torques and velocities, as far as they exist."""
        return [signal for signal in (self.q, self.torque, self.velocity) if signal is not None]


@dataclass(frozen=True, eq=False)
class Excerpt:
    """One stretch, smoothed and thinned.

    Attributes:
        t: (M,) [s].
        q: smoothed positions (M, n).
        dq: their derivative (M, n).
        ddq: their second derivative (M, n).
        rest: whether each joint stands (M, n). Friction or a brake may hold it with any torque, so that these rows
            count in no fit of the joint.
        raw: torque or current as it was logged (M, n); None without.
        column: the log's own velocities, smoothed by the same filter (M, n); None without.
        place: of the thinned rows on the grid (M,).
        grid: all times of the stretch (N,) [s].
        smoothed: torque or current on the grid, smoothed (N, n); None without.
    """

    t: Array
    q: Array
    dq: Array
    ddq: Array
    rest: NDArray[np.bool_]
    raw: Array | None
    column: Array | None
    place: NDArray[np.intp]
    grid: Array
    smoothed: Array | None

    def thinned(self, stride: int) -> Excerpt:
        """Keeps one of `stride` rows."""
        kept: dict[str, Any] = {
            name: None if array is None else array[::stride]
            for name in ("t", "q", "dq", "ddq", "rest", "raw", "column", "place")
            for array in [getattr(self, name)]
        }
        return replace(self, **kept)

    def torque_at(self, t: Array, order: int = 0) -> Array:
        """Interpolates the smoothed torque or current (K, n) at times (K,) [s], or its derivative of an order."""
        if t is self.t and not order and self.smoothed is not None:
            return self.smoothed[self.place]
        return np.asarray(self._spline(np.clip(t, self.grid[0], self.grid[-1]), order))

    def torque_near(self, shift: Array, joint: int, stride: int) -> Array:
        """Gives the smoothed torque or current of a joint at several shifts, linear between samples.

        Args:
            shift: by which it is logged later (S,) [s].
            joint: counted from 0.
            stride: between the rows that are kept.

        Returns:
            (S, M / stride); beyond the ends the last sample.
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
        # Only few of the excerpts need it.
        assert self.smoothed is not None
        return CubicSpline(self.grid, self.smoothed)


def cutoffs(period: float) -> tuple[float, ...]:
    """Gives the cut-offs [Hz] that a sample period [s] allows, the lowest first."""
    highest = NYQUIST_SHARE / period
    return tuple(cutoff for cutoff in CUTOFFS if cutoff <= highest) or (highest,)


def stretches(parts: Sequence[tuple[int, int]]) -> list[slice]:
    """Chooses evenly distributed rows, about `ROWS` in all, as slices without a gap.

    Args:
        parts: (first, stop) of the stretches without a gap.
    """
    total = sum(stop - first for first, stop in parts)
    if total <= ROWS:
        return [slice(first, stop) for first, stop in parts]
    length = ROWS // STRETCHES
    chosen = []
    for centre in (np.arange(STRETCHES) + 0.5) * total / STRETCHES:
        # The centre is counted over all parts. The slice is moved inside the part that contains it.
        passed = 0
        for first, stop in parts:
            if centre < passed + stop - first:
                begin = int(np.clip(first + centre - passed - length / 2, first, max(first, stop - length)))
                chosen.append(slice(begin, min(begin + length, stop)))
                break
            passed += stop - first
    return chosen


def stretch(log: Log, torque: Array | None, piece: slice, period: float) -> Stretch | None:
    """Interpolates some rows on an even grid.

    Args:
        log: the log.
        torque: (N, n), or None.
        piece: the rows.
        period: median step of the log [s].

    Returns:
        The stretch; None if it is too short.
    """
    t, q = log.t[piece], log.q[piece]
    duration = float(t[-1] - t[0])
    grid = t[0] + period * np.arange(int(duration / period + 1e-6) + 1)
    if len(grid) < FEWEST_SAMPLES:
        return None
    tau, velocity = (None if values is None else values[piece] for values in (torque, log.dq))
    # A position that repeats the one before is old.
    fresh = np.concatenate([[True], np.any(q[1:] != q[:-1], axis=1)])
    uneven = np.abs(np.diff(t) - period).max() > UNEVEN * period
    if not uneven and fresh.all():
        return Stretch(t, q, tau, velocity)
    fresh = fresh if fresh.sum() > FRESH * len(t) else np.ones(len(t), dtype=bool)
    tau, velocity = (None if values is None else _at(grid, t, values) for values in (tau, velocity))
    return Stretch(grid, _at(grid, t[fresh], q[fresh]), tau, velocity)


def excerpts_of(parts: Sequence[Stretch], period: float, cutoff: float) -> tuple[Excerpt, ...]:
    """Smooths position and torque of stretches by the same filter, and thins them.

    Args:
        parts: the stretches, all with the same signals.
        period: of their grids [s].
        cutoff: [Hz].

    Returns:
        The stretches without their inaccurate ends; too short ones are left out.
    """
    smoothed: dict[int, Iterator[Array]] = {}
    for length in {len(part.t) for part in parts}:
        # All signals of all stretches of one length are filtered at once: the set-up costs as much as a column.
        signals = [signal for part in parts if len(part.t) == length for signal in part.signals]
        widths = np.cumsum([signal.shape[1] for signal in signals])
        smoothed[length] = iter(np.split(low_pass(np.hstack(signals), period, cutoff), widths[:-1], axis=1))
    found = (_excerpt(part, [next(smoothed[len(part.t)]) for _ in part.signals], period, cutoff) for part in parts)
    excerpts = [part for part in found if part is not None]
    rows = max(sum(len(part.t) for part in excerpts), 1)
    speed = np.sqrt(sum(np.sum(part.dq**2, axis=0) for part in excerpts) / rows)
    return tuple(replace(part, rest=rows_at_rest(part.t, part.q, speed)) for part in excerpts)


def _excerpt(part: Stretch, smoothed: Sequence[Array], period: float, cutoff: float) -> Excerpt | None:
    """Thins one stretch with smoothed signals; None if it is too short."""
    grid, edge = part.t, EDGE / cutoff
    inside = np.flatnonzero((grid >= grid[0] + edge) & (grid <= grid[-1] - edge))
    inside = inside[:: max(1, int(1.0 / (KEPT * cutoff * period)))]
    if len(inside) < FEWEST_KEPT:
        return None
    smooth = iter(smoothed)
    q = next(smooth)
    dq, ddq = differentiate(q, period)
    tau = None if part.torque is None else next(smooth)
    return Excerpt(
        grid[inside],
        q[inside],
        dq[inside],
        ddq[inside],
        np.zeros((len(inside), q.shape[1]), dtype=bool),
        None if part.torque is None else part.torque[inside],
        None if part.velocity is None else next(smooth)[inside],
        inside,
        grid,
        tau,
    )


def _at(grid: Array, t: Array, values: Array) -> Array:
    return np.column_stack([np.interp(grid, t, column) for column in values.T])

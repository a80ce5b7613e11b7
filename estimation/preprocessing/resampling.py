"""Uneven, repeated and quantised position samples, on a uniform grid."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline, PchipInterpolator

from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.common.stretches import spans


@dataclass(frozen=True)
class Resampled:
    """Positions on a uniform grid.

    Attributes:
        t: times (M,) [s].
        q: positions (M, n) [rad or m].
        period: of the grid [s].
        dropped: rows of the log that repeated an older position.
        original: the log's own times (N,) [s].
        fresh_t: times (K,) of the rows that are not stale [s].
        fresh_q: positions (K, n) of those rows, as they were logged.
    """

    t: Array
    q: Array
    period: float
    dropped: int
    original: Array
    fresh_t: Array
    fresh_q: Array


def resample(t: Array, q: Array) -> Resampled:
    """Puts positions on a grid of the log's period, or of the median period where time is uneven.

    Args:
        t: increasing times (N,) [s].
        q: positions (N, n) [rad or m].

    Returns:
        The grid; where time is even and no row is stale, the log itself.

    Raises:
        InputError: fewer than 20 distinct rows.
    """
    stale = stale_rows(t, q)
    kept_t, kept_q = (t[~stale], q[~stale]) if stale.any() else (t, q)
    if len(kept_t) < 20:
        raise InputError(f"{len(kept_t)} rows", allowed="20 or more", remedy="record a longer log")
    steps = np.diff(t)
    # Relative jitter of the time stamps above which straight lines between samples would leave kinks.
    even = np.ptp(steps) <= 0.02 * np.median(steps)
    # The mean of even steps: large times round each step, and a grid by the median would drift off the samples.
    period = float(np.mean(steps) if even else np.median(steps))
    grid = t[0] + period * np.arange(int(np.floor((t[-1] - t[0]) / period + 1e-6)) + 1)
    if stale.any() or not even:
        values = between_rows(kept_t, kept_q, np.minimum(grid, kept_t[-1]), period)
    elif len(grid) == len(t) and np.abs(grid - t).max() <= 1e-6 * period:
        values = q
    else:
        values = np.column_stack([np.interp(grid, kept_t, column) for column in kept_q.T])
    return Resampled(grid, values, period, int(stale.sum()), t, kept_t, kept_q)


def between_rows(t: Array, q: Array, at: Array, period: float) -> Array:
    """Interpolates positions (N, n) by a cubic spline, and across holes by a cubic that does not overshoot.

    The latter alone (Fritsch and Butland 1984) has too small slopes at reversals. For a fast joint sampled with a
    jitter of a fifth of the period, its error is ten encoder steps; the spline's is none.

    Args:
        t: increasing times (N,) [s].
        q: positions (N, n) [rad or m].
        at: times (M,) [s] within them.
        period: usual step of time [s].
    """
    # Rows nearer than a tenth of a period are one, ...
    t, q = _merged(t, q, 0.1 * period)
    values = np.asarray(CubicSpline(t, q)(at))
    # ... and steps above eight periods are holes.
    holes = np.flatnonzero(np.diff(t) > 8.0 * period)
    inside = np.isin(np.searchsorted(t, at, side="right") - 1, holes)
    if inside.any():
        # Positions that differ by denormal numbers have slopes whose harmonic mean overflows on its way to zero.
        with np.errstate(over="ignore"):
            values[inside] = PchipInterpolator(t, q)(at[inside])
    return values


def _merged(t: Array, q: Array, nearest: float) -> tuple[Array, Array]:
    """Takes the mean of rows that crowd: noise of two at nearly the same time would be a slope of any size."""
    if np.diff(t).min() >= nearest:
        return t, q
    begins, first = [0], float(t[0])
    for i, time in enumerate(t.tolist()):
        if time - first >= nearest:
            begins.append(i)
            first = time
    counts = np.diff([*begins, len(t)])
    return np.add.reduceat(t, begins) / counts, np.add.reduceat(q, begins) / counts[:, None]


def stale_rows(t: Array, q: Array) -> NDArray[np.bool_]:
    """Finds rows that repeat the position of the row before although the arm has moved on.

    A slow network delivers the same message twice; a filter would make a jerk of it. A row counts when all joints
    repeat, for at most three rows, and some joint that keeps its direction is more than two encoder steps off the line
    between the distinct rows around.

    Args:
        t: times (N,) [s].
        q: positions (N, n).

    Returns:
        (N,), True where the row is stale.
    """
    repeated = np.concatenate([[False], (np.diff(q, axis=0) == 0).all(axis=1)])
    if not repeated.any():
        return repeated
    line = np.column_stack([np.interp(t, t[~repeated], column[~repeated]) for column in q.T])
    # A repeated value is stale when the arm has moved on by more than the encoder could hide.
    off = (np.abs(q - line) > 2.0 * np.maximum(_step(q), 1e-9)) & _passing(q, repeated)
    # Length of the run of repeats that each row belongs to.
    length = np.zeros(len(t), dtype=int)
    for start, stop in spans(repeated):
        length[start:stop] = stop - start
    # A longer hold is a rest, or a crawl below the encoder's step, and no repeated message.
    return repeated & (length <= 3) & off.any(axis=1)


def _passing(q: Array, repeated: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Where a joint (N, n) goes on in the direction in which it came: about a turning point equal rows are right."""
    steps = np.diff(q[~repeated], axis=0, prepend=np.nan, append=np.nan)  # before and after each distinct row
    held = np.cumsum(~repeated) - 1
    return ~(steps[held] * steps[held + 1] <= 0)


def _step(q: Array) -> Array:
    """The smallest change of each column (n,): the encoder's step, where one shows."""
    steps = np.abs(np.diff(q, axis=0))
    return np.where(steps > 0, steps, np.inf).min(axis=0)

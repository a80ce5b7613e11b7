"""Rows whose times are those of the logger, not of the measurement: written late, or rounded."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimation.logs.clocks import uniform_times
from estimation.recordings.rows.timing import FEWEST, measure_timing
from robots.common.arrays import Array
from robots.signals import Log

# A stall is a step above this many median steps and below this time [s]. Steps below RUSH median steps follow it, for
# the rows that waited in a queue.
STALL, LONGEST, RUSH = 1.6, 2.0, 0.9
# No row was lost in a stall if its rows fill the time, to this share of a step.
FILLED = 0.5
# Steps are rounded if all are multiples of the smallest, to this share of it.
WHOLE = 0.01
# Rounding by less than this share of a step does no harm.
FINE = 0.05


@dataclass(frozen=True)
class Stalls:
    """Interruptions of a logger, after which it wrote the delayed rows.

    Attributes:
        count: of the interruptions.
        longest: [s].
        first: first row that is late, counted from 0.
        moved: number of rows that were moved to uniform times.
    """

    count: int
    longest: float
    first: int
    moved: int


@dataclass(frozen=True)
class Rounding:
    """Times that are rounded to multiples of a value.

    Attributes:
        resolution: that value [s].
        period: true sample period [s].
    """

    resolution: float
    period: float


@dataclass(frozen=True, eq=False)
class CorrectedTimes:
    """Times of the measurement, as far as they can be reconstructed.

    Attributes:
        t: (N,) [s]; the log's own array if nothing was corrected.
        lost: rows whose times cannot be reconstructed.
        stalls: None without.
        rounding: None without.
    """

    t: Array
    lost: NDArray[np.intp]
    stalls: Stalls | None = None
    rounding: Rounding | None = None


def correct_times(log: Log) -> CorrectedTimes:
    """Corrects the times of rows that were written late, and of rounded times.

    A queue delays messages, and each gets its time when it is read: one step is too long, the following are too short.
    If no message was lost, the rows are moved to uniform times. If some were lost, it is unknown which: the rows are
    listed in `lost`. Nothing is changed if the positions fit the logged times better: a logger that measures again to
    catch up has correct times.

    Args:
        log: the log.
    """
    none = np.zeros(0, dtype=np.intp)
    if len(log) < FEWEST:
        return CorrectedTimes(log.t, none)
    steps = np.diff(log.t)
    period = float(np.median(steps))
    if (rounded := _rounded(log, steps, period)) is not None:
        return rounded
    even, lost, begins = log.t.copy(), [none], []
    for begin in np.flatnonzero((steps > STALL * period) & (steps < LONGEST)).tolist():
        end = begin + 1
        while end < len(steps) and steps[end] < RUSH * period:
            end += 1
        if end == begin + 1:
            continue  # rows are missing, none is late
        begins.append(begin)
        if abs(log.t[end] - log.t[begin] - (end - begin) * period) < FILLED * period:
            even[begin + 1 : end + 1] = log.t[begin] + period * np.arange(1, end - begin + 1)
        else:
            lost.append(np.arange(begin + 1, end))
    late, left_out = np.flatnonzero(even != log.t), np.concatenate(lost)
    if not _fit_better(log, even, late):
        even, late = log.t, none
    if not len(late) + len(left_out):
        return CorrectedTimes(log.t, none)
    return CorrectedTimes(even, left_out, Stalls(len(begins), float(steps[begins].max()), begins[0] + 1, len(late)))


def _rounded(log: Log, steps: Array, period: float) -> CorrectedTimes | None:
    """Gives uniform times if the logged ones are these, rounded; None otherwise."""
    resolution = float(steps.min())
    multiples = steps / resolution
    if np.abs(multiples - np.round(multiples)).max() > WHOLE:
        return None
    rows = np.arange(len(log))
    even, true_period = uniform_times(log.t, [slice(*part) for part in measure_timing(log.t).parts])
    error = float(np.abs(log.t - even).max())
    # Equal steps are uniform already, whatever their rounding.
    if not FINE * period < error <= resolution or not _fit_better(log, even, rows[1::2]):
        return None
    return CorrectedTimes(even, np.zeros(0, dtype=np.intp), rounding=Rounding(resolution, period=true_period))


def _fit_better(log: Log, even: Array, late: NDArray[np.intp]) -> bool:
    """Whether the positions of late rows are nearer to those interpolated from the others at even than at logged times.

    Args:
        log: the log.
        even: corrected times (N,) [s].
        late: rows to compare.
    """
    if not len(late):
        return False
    known = np.setdiff1d(np.arange(len(log)), late)
    size = np.abs(np.diff(log.q, axis=0)).mean(axis=0)
    errors = [
        np.abs(log.q[late] - np.column_stack([np.interp(t[late], t[known], q) for q in log.q[known].T]))
        for t in (even, log.t)
    ]
    corrected, logged = (float((error[:, size > 0] / size[size > 0]).sum()) for error in errors)
    return corrected < logged

"""Outliers in single rows: a garbled message, a lost value, a typing error."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from estimation.recordings.rows.columns import Columns
from estimation.recordings.rows.timing import FEWEST
from robots.common.arrays import Array
from robots.signals import Log

Rows = NDArray[np.intp]

# A row is an outlier if it leaves its neighbours and returns by more than this many times the median of such moves, ...
OUTLIER = 25.0
# ... and by more than this share of the column's usual range: a torque may return at once, a position cannot.
SHARE_OF_POSITION, SHARE_OF_SIGNAL = 0.01, 0.1
# Share of its larger step by which an outlier returns at least: a jump goes on from where it led to.
BACK = 0.5
# Steps of a coarse sensor by which its value flickers.
FLICKER = 3.0
# Share of rows above which outliers are not isolated: in a torque they are noise, in a position they make it useless.
NOT_ISOLATED = 0.03
# Peaks of torque within so many rows of a reversal of any joint are real if more than MOST of all peaks are there:
# friction that changes its direction shakes the arm, and a sharp fall of it makes a peak.
BESIDE, MOST = 4, 0.5
# Share of the speed nearby below which a joint stands between two moves: its friction falls to nothing for a row.
STANDS = 0.1
# Number of values of a column from which its usual range and changes are estimated.
SAMPLES = 20_000


def outlier_rows(values: Array, share: float, step: float, *, noisy: bool) -> Rows:
    """Finds the outliers of a column (N,): a step away, and the same step back.

    The return of a row is the smaller of its two steps, if they have opposite signs. Usual noise stays within a few
    times its median. A step of the signal, as of friction at a reversal, does not return.

    Args:
        values: the column.
        share: of the range between its 5th and 95th percentiles that an outlier must exceed.
        step: resolution of the column, 0 if it has none.
        noisy: whether the column returns often, as a torque does; a position continues in its direction.
    """
    steps = np.diff(values)
    # Percentiles rather than the range, which the outliers themselves would set.
    low, high = np.quantile(values[:: max(1, len(values) // SAMPLES)], (0.05, 0.95))
    usual = _returns(steps, np.arange(0, len(steps) - 1, max(1, (len(steps) - 1) // SAMPLES)))
    if noisy:
        usual = usual[usual > 0]
    noise = OUTLIER * float(np.median(usual)) if len(usual) else 0.0
    level = max(noise, share * float(high - low), FLICKER * (step or _flicker(values)))
    if not level > 0:
        return np.empty(0, dtype=np.intp)
    large = np.abs(steps) > level
    rows = np.flatnonzero(large[:-1] & large[1:])
    return rows[_returns(steps, rows) > BACK * np.maximum(np.abs(steps[rows]), np.abs(steps[rows + 1]))] + 1


def find_outliers(columns: Columns) -> dict[tuple[str, int], Rows]:
    """Finds the outliers of each column of position and of torque or current.

    Args:
        columns: of the log.

    Returns:
        Rows by the column's prefix and joint, counted from 0; only columns with outliers.
    """
    found: dict[tuple[str, int], Rows] = {}
    for joint, column in enumerate(columns.q):
        found["q", joint] = outlier_rows(column, SHARE_OF_POSITION, columns.position_steps[joint], noisy=False)
    signals = [] if columns.signal is None else list(columns.signal)
    resolutions = columns.signal_steps
    peaks = [outlier_rows(x, SHARE_OF_SIGNAL, resolutions[j], noisy=True) for j, x in enumerate(signals)]
    if any(map(len, peaks)):
        reversing = _reversing_rows(columns)
        peaks = [_without_reversals(rows, reversing) for rows in peaks]
    for joint, (column, rows) in enumerate(zip(signals, peaks, strict=True)):
        lost = _lost_values(column, columns.q[joint], resolutions[joint])
        found[columns.prefix, joint] = np.union1d(rows, lost)
    return {place: rows for place, rows in found.items() if len(rows)}


def are_isolated(rows: Rows, samples: int) -> bool:
    """Whether outliers are so few that a column of this length can be used without them."""
    return len(rows) <= NOT_ISOLATED * samples


def isolated_rows(columns: Columns, outliers: dict[tuple[str, int], Rows]) -> Rows:
    """Gives the rows with an isolated outlier in any column, sorted."""
    samples = columns.q.shape[1]
    rows = [found for found in outliers.values() if are_isolated(found, samples)]
    return np.unique(np.concatenate(rows)) if rows else np.empty(0, dtype=np.intp)


def interpolated(log: Log, kinds: Collection[str] = ("q", "tau", "current")) -> Log:
    """Replaces isolated outliers in each column by interpolation; the times of the rows stay.

    Args:
        log: with unwrapped angles.
        kinds: which columns.
    """
    values: dict[str, Array] = {}
    for (prefix, joint), rows in find_outliers(Columns.of(log)).items():
        kind = "current" if prefix == "i" else prefix
        known = np.setdiff1d(np.arange(len(log)), rows)
        if kind not in kinds or not are_isolated(rows, len(log)) or len(known) < FEWEST:
            continue
        column = values.setdefault(kind, np.array(getattr(log, kind)))[:, joint]
        if prefix == "q":
            # A straight line would cut the corner of a motion by more than an encoder step.
            column[rows] = CubicSpline(log.t[known], column[known])(log.t[rows])
        else:
            column[rows] = np.interp(log.t[rows], log.t[known], column[known])
    return replace(log, **values) if values else log  # type: ignore[arg-type]


def _returns(steps: Array, rows: Rows) -> Array:
    """Gives the smaller of a step (N - 1,) and the next one if they have opposite signs, otherwise 0; at some rows."""
    before, after = steps[rows], steps[rows + 1]
    return np.where((before > 0) != (after > 0), np.minimum(np.abs(before), np.abs(after)), 0.0)


def _flicker(values: Array) -> float:
    """Gives the step of a sensor at rest that changes between two values, too often for outliers; 0 for any other."""
    low, high = float(values.min()), float(values.max())
    some = values[:: max(1, len(values) // SAMPLES)]
    if not low < high or ((some > low) & (some < high)).any():
        return 0.0
    counts = [int(np.count_nonzero(values == value)) for value in (low, high)]
    return high - low if sum(counts) == len(values) and min(counts) > NOT_ISOLATED * len(values) else 0.0


def _lost_values(values: Array, q: Array, step: float) -> Rows:
    """Finds rows in which a torque or current is exactly zero although the joint moves: messages without a value.

    Args:
        values: the column (N,).
        q: the joint's position (N,).
        step: resolution of the column, 0 if it has none.
    """
    rows = np.flatnonzero((values[1:] == 0.0) & (q[1:] != q[:-1])) + 1
    # Zero is a usual value of a coarse torque, and of a drive that is off.
    return rows if step == 0 and 2 <= len(rows) <= NOT_ISOLATED * len(values) else np.empty(0, dtype=np.intp)


def _reversing_rows(columns: Columns) -> NDArray[np.bool_]:
    """Marks the rows (N,) near those in which any joint reverses, starts or stops, be it for a row."""
    reversing = np.zeros(len(columns.q[0]), dtype=bool)
    for q in columns.q:
        # Over some rows: the noise of an encoder is no reversal.
        direction = np.sign(q[BESIDE:] - q[:-BESIDE])
        turns = np.flatnonzero(direction[1:] != direction[:-1]) + BESIDE // 2
        here, around = np.abs(q[2:] - q[:-2]) / 2, np.abs(q[2 * BESIDE :] - q[: -2 * BESIDE]) / (2 * BESIDE)
        stands = np.flatnonzero(here[BESIDE - 1 : 1 - BESIDE] < STANDS * around) + BESIDE
        turns = np.concatenate([turns, stands])
        reversing[np.unique(np.clip(turns[:, None] + np.arange(-BESIDE, BESIDE + 1), 0, len(q) - 1))] = True
    return reversing


def _without_reversals(rows: Rows, reversing: NDArray[np.bool_]) -> Rows:
    """Leaves out peaks of torque near reversals, if most of them are there and chance would put few there."""
    near = reversing[rows]
    return rows[~near] if len(rows) and near.mean() > MOST > 2 * reversing.mean() else rows

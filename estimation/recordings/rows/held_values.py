"""Values that are old: columns that hung, rows that repeat the row before, torques that are updated less often."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimation.recordings.rows.columns import Columns
from estimation.recordings.rows.motion import moving_rows
from estimation.recordings.rows.timing import FEWEST
from robots.common.arrays import Array
from robots.common.stretches import ends
from robots.signals import Log

Rows = NDArray[np.intp]

# A column jumps by a step above this many times its 99th percentile; that is estimated from some of the steps.
JUMP, QUANTILE, SAMPLES = 3.0, 0.99, 50_000
# A position also jumps by a step above this many times the largest step within so many rows before and after.
LOCAL_JUMP, BESIDE = 10.0, 20
# With equal neighbours in more than this share of the rows, a column is coarse or its joint stands: it is not judged.
COARSE = 0.5
# Rows in motion for which a column must be constant, over the longest run that chance explains.
LONG = 3.0
HALF = FEWEST // 2  # rows

# Encoder steps per row above which a moving joint has a new position in each row.
FAST = 2.0
# Share of such rows that repeat the row before, from which they are copies: the logger samples faster than the
# controller answers. A single message that comes twice delays nothing.
COPIED = 0.1

# Share of the updates that come as many rows after the one before as most, give or take one. A torque that repeats by
# its own resolution changes irregularly.
REGULAR = 0.9
UPDATES = 20  # updates


@dataclass(frozen=True)
class Hang:
    """The longest run of rows in which a column hung.

    Attributes:
        prefix: of the column.
        joint: counted from 0.
        first: row, counted from 0; its value is still a measured one.
        rows: number of rows with that value.
    """

    prefix: str
    joint: int
    first: int
    rows: int


def find_hangs(columns: Columns, moving: NDArray[np.bool_]) -> tuple[Hang, ...]:
    """Finds columns that hold one value while the arm moves, and then jump: a sensor or a bus hung.

    A joint that stands holds its value too, but does not jump when it starts.

    Args:
        columns: of the log.
        moving: rows in which the arm moves (N,).
    """
    if columns.q.shape[1] < FEWEST:
        return ()
    hangs = (_longest_hang(prefix, joint, column, moving[1:]) for prefix, joint, column in columns.named())
    return tuple(hang for hang in hangs if hang is not None)


def cut_hangs(parts: Sequence[tuple[int, int]], hangs: Sequence[Hang]) -> tuple[tuple[int, int], ...]:
    """Cuts the rows in which a column hung out of parts (first, stop) of a log."""
    rest = list(parts)
    for hang in hangs:
        first, stop = hang.first + 1, hang.first + hang.rows
        pieces = [piece for a, b in rest for piece in ((a, min(b, first)), (max(a, stop), b))]
        rest = [(a, b) for a, b in pieces if a < b]
    return tuple(rest)


def _longest_hang(prefix: str, joint: int, column: Array, moving: NDArray[np.bool_]) -> Hang | None:
    held = column[1:] == column[:-1]
    # A run of FEWEST rows contains two neighbours of every HALF-th row.
    some = held[::HALF]
    if not (some[1:] & some[:-1]).any():
        return None
    share = float(held.mean())
    if share > COARSE:
        return None
    # With a share p of equal neighbours, chance gives a run of log(N) / log(1/p) among N rows.
    chance = np.log(len(column)) / np.log(1.0 / max(share, 1.0 / len(column)))
    # Rows in which the arm rests do not count.
    starts, stops = ends(held)
    passed = np.concatenate([[0], np.cumsum(moving)])
    long = passed[stops] - passed[starts] >= max(LONG * chance, FEWEST)
    if not long.any():
        return None
    steps = np.abs(np.diff(column))
    usual = JUMP * float(np.quantile(steps[:: max(1, len(steps) // SAMPLES)], QUANTILE))
    hung = [
        (int(stop - start), int(start))
        for start, stop in zip(starts[long], stops[long], strict=True)
        # A brake holds a torque constant until it is released: the size of the steps beside it proves nothing.
        if _step_at(steps, stop) > (min(usual, _local_jump(steps, start, stop)) if prefix == "q" else usual)
    ]
    if not hung:
        return None
    length, start = max(hung)
    return Hang(prefix, joint, start, length + 1)


def _step_at(steps: Array, row: int) -> float:
    return float(steps[row]) if row < len(steps) else 0.0


def _local_jump(steps: Array, start: int, stop: int) -> float:
    """Gives the step after a constant run [start, stop) that is a jump beside the steps around; inf if these are zero.

    A slow joint that continues as slowly as before has jumped, however fast it is elsewhere.
    """
    beside = np.concatenate([steps[max(start - BESIDE, 0) : start], steps[stop + 1 : stop + 1 + BESIDE]])
    most = float(beside.max(initial=0.0))
    return LOCAL_JUMP * most if most > 0 else np.inf


@dataclass(frozen=True, eq=False)
class RepeatedRows:
    """Rows that are equal to the row before although the arm moves.

    Attributes:
        rows: counted from 0.
        share: of the rows in which the arm moves.
        copies: the same rows, if they hold old values with new times; none if encoder steps explain them.
    """

    rows: NDArray[np.intp]
    share: float
    copies: NDArray[np.intp]


def find_repeated_rows(log: Log, columns: Columns, moving: NDArray[np.bool_]) -> RepeatedRows:
    """Finds rows that repeat the row before in every column.

    A logger that samples faster than the controller answers writes old positions and torques with new times.

    Args:
        log: the log.
        columns: of the log.
        moving: rows in which the arm moves (N,).
    """
    none = np.zeros(0, dtype=np.intp)
    if len(log) < FEWEST:
        return RepeatedRows(none, 0.0, none)
    same = np.ones(len(log) - 1, dtype=bool)
    for _, _, values in columns.named():
        same &= values[1:] == values[:-1]
    moves = moving[1:]
    repeated = same & moves
    rows = np.flatnonzero(repeated) + 1
    share = float(repeated.sum() / max(int(moves.sum()), 1))
    if not len(rows):
        return RepeatedRows(rows, share, none)
    fast = moving_rows(log, columns, steps=FAST)[1:]
    copied = float((same & fast).sum()) > COPIED * max(int(fast.sum()), 1)
    return RepeatedRows(rows, share, rows if copied else none)


def find_updates(columns: Columns) -> Rows:
    """Finds the rows in which the torques or currents are updated, where others repeat them; none if all are.

    Args:
        columns: of a log.

    Returns:
        Rows (K,), counted from 0.
    """
    none = np.zeros(0, dtype=np.intp)
    if columns.signal is None or not columns.varies.any():
        return none
    changes = np.any(columns.signal[:, 1:] != columns.signal[:, :-1], axis=0)
    rows = np.flatnonzero(changes) + 1
    if len(rows) < UPDATES:
        return none
    steps = np.diff(rows)
    usual = int(np.median(steps))
    regular = float(np.mean(np.abs(steps - usual) <= (1 if usual > 2 else 0)))
    return np.union1d(0, rows) if usual > 1 and regular > REGULAR else none


def between_updates(log: Log, rows: Rows) -> Log:
    """Interpolates the torques and currents of a log linearly between the rows (K,) in which they are updated."""
    if not len(rows):
        return log

    def linear(values: Array | None) -> Array | None:
        if values is None:
            return None
        return np.column_stack([np.interp(log.t, log.t[rows], column[rows]) for column in values.T])

    return replace(log, tau=linear(log.tau), current=linear(log.current))

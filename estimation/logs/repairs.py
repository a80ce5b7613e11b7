"""Repairs by the reader that need no guess: rows that were written twice, and times on a coarse grid."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from estimation.logs.clocks import uniform_times
from robots.common.tables.table import Table

Notes = list[dict[str, object]]

# Times are rounded if their steps are multiples of the smallest, to this share of it; a step of more multiples of the
# usual one is a gap. Uniform times differ from the rounded ones by no more than this share of the smallest step.
WHOLE, GAP, WITHIN = 0.01, 3.0, 0.75
# Fewest rows, and share of them that repeat a time, by which a grid is known: a single row that repeats is an error.
FEWEST, REPEATED = 20, 0.005


def repair_rows(table: Table) -> tuple[Table, NDArray[np.intp], Notes]:
    """Drops rows that were written twice, then puts times on a coarse grid back on a uniform one.

    Args:
        table: with the column ``t``; all columns are numbers.

    Returns:
        The table, the original index of each row that is left, and notes of what was done.
    """
    table, kept, notes = drop_repeated_rows(table)
    spread, more = spread_rounded_times(table)
    return spread, kept, [*notes, *more]


def spread_rounded_times(table: Table) -> tuple[Table, Notes]:
    """Puts times that repeat because they were rounded to a coarse grid on uniform times.

    A clock with a resolution of 10 ms gives the same time to two or three rows of 4 ms. Nothing is changed if the rows
    are not uniform to that resolution.

    Args:
        table: with the column ``t``.

    Returns:
        The table, and a note if it was changed.
    """
    t = np.asarray(table.columns["t"], dtype=float)
    if len(t) < FEWEST or not np.isfinite(t).all():
        return table, []
    steps = np.diff(t)
    moved = steps[steps > 0]
    if len(moved) < 2 or (steps < 0).any() or not (steps == 0).mean() > REPEATED:
        return table, []
    resolution = float(moved.min())
    multiples = moved / resolution
    if np.abs(multiples - np.round(multiples)).max() > WHOLE * max(1.0, float(multiples.max())):
        return table, []
    gaps = np.flatnonzero(steps > GAP * max(resolution, float(np.median(moved)))) + 1
    edges = [0, *gaps.tolist(), len(t)]
    even, period = uniform_times(t, [slice(first, stop) for first, stop in pairwise(edges)])
    if not np.abs(even - t).max() <= WITHIN * resolution or not (np.diff(even) > 0).all():
        return table, []
    note = {
        "name": "rounded_times",
        "text": f"times are rounded to {1e3 * resolution:.3g} ms and repeat; the sample period is "
        f"{1e3 * period:.4g} ms",
        "action": "rows are moved to uniform times; log the time with more digits",
        "value": len(t),
    }
    return replace(table, columns={**table.columns, "t": even}), [note]


def drop_repeated_rows(table: Table) -> tuple[Table, NDArray[np.intp], Notes]:
    """Drops rows whose time and all other values repeat the row before.

    A logger that flushes twice writes them. A row that repeats the time with other values is no copy, and stays to be
    refused.

    Args:
        table: with the column ``t``; all columns are numbers.

    Returns:
        The table, the original index of each row that is left, and notes of what was done.
    """
    time = table.columns["t"]
    rows = np.arange(len(table))
    twice = np.concatenate([[False], time[1:] == time[:-1]])
    if not twice.any():
        return table, rows, []
    where = np.flatnonzero(twice)
    same = np.ones(len(where), dtype=bool)
    for values in table.columns.values():
        now, before = values[where], values[where - 1]
        same &= (now == before) | (np.isnan(now) & np.isnan(before))
    drop = where[same]
    if not len(drop):
        return table, rows, []
    kept = np.delete(rows, drop)
    note = {
        "name": "repeated_rows",
        "text": f"{len(drop)} row{'s are' if len(drop) > 1 else ' is'} identical to the row before, including the time",
        "action": "the copies are ignored",
        "value": len(drop),
    }
    columns = {name: values[kept] for name, values in table.columns.items()}
    return replace(table, columns=columns), kept, [note]

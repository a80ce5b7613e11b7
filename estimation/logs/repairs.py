"""Repairs by the reader that need no guess: rows that were written twice."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from robots.common.tables.table import Table


def drop_repeated_rows(table: Table) -> tuple[Table, np.ndarray, list[dict[str, object]]]:
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

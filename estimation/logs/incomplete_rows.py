"""Rows in which a needed column has no number: left out, or completed if columns come in turns."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimation.logs.columns import parse_name
from estimation.logs.needed_columns import needed_prefixes
from robots.common.errors import InputError
from robots.common.plain import several
from robots.common.tables.table import Table

Notes = list[dict[str, Any]]

# Share of the rows with the rarest column that are complete, from which on the others are simply left out.
MOST = 0.9
# A value is interpolated between two of its column that are at most so many of its usual steps apart.
STEPS = 3.0
# Times above this one are those of a clock that counts from 1970 [s]; this is in 1973.
SINCE_1970 = 1e8
# Share of left-out rows from which on a note is a warning.
MANY = 0.1


def complete_rows(table: Table) -> tuple[Table, NDArray[np.intp], Notes]:
    """Keeps the rows that have a time and a number in each needed column.

    A second publisher on a topic repeats positions without efforts; sensors drop samples. If columns come in turns, as
    the halves of the joints from two publishers, each is interpolated linearly to the times of the rarest one.

    Args:
        table: with the column ``t`` and the columns of a log; all are numbers.

    Returns:
        The table, the original index of each row that is left, and notes of what was done.

    Raises:
        InputError: a needed column without numbers, or no rows that can be completed.
    """
    needed = [name for name in table.names if _prefix(name) in needed_prefixes(table.names)]
    timed, notes = _timed_rows(table)
    has = np.column_stack([np.ones(len(table), dtype=bool) & ~np.isnan(table.columns[name]) for name in needed])
    has &= timed[:, None]
    whole = has.all(axis=1)
    if whole.all():
        return table, np.arange(len(table)), notes
    for name, own in zip(needed, has.T, strict=True):
        if not own.any():
            raise InputError(
                f"no number in any of {several(len(table), 'row')}",
                file=table.path,
                column=name,
                allowed="numbers in some rows",
                remedy="record the values of all joints",
                kind="no_numbers",
            )
    rarest = int(np.argmin(has.sum(axis=0)))
    patterns = np.unique(has[timed], axis=0)
    if whole.sum() < MOST * has[:, rarest].sum() and len(patterns) <= len(needed) + 1:
        return _in_turns(table, needed, has, rarest, notes)
    kept = np.flatnonzero(whole)
    if len(kept) < 2:
        raise InputError(
            f"{several(len(kept), 'row')} of {len(table)} with numbers in all of {', '.join(needed)}",
            file=table.path,
            column=needed[rarest],
            allowed="2 or more",
            remedy="record all signals at the same times, or resample them to the same times",
        )
    lacking = timed & ~whole
    if lacking.any():
        gaps = [name for name, column in zip(needed, has.T, strict=True) if (timed & ~column).any()]
        first = int(np.flatnonzero(lacking)[0])
        start = table.columns["t"][np.flatnonzero(timed)[0]]
        notes.append(
            {
                "name": "incomplete_rows",
                "text": f"{lacking.sum()} of {len(table)} rows have no number in {_listed(gaps)}, the first of them "
                f"row {table.line(first)}, {table.columns['t'][first] - start:.4g} s after the start",
                "action": "these rows are left out",
                "value": int(lacking.sum()),
                "severity": "warning" if lacking.mean() > MANY else "info",
            }
        )
    return _rows(table, kept), kept, notes


def _timed_rows(table: Table) -> tuple[NDArray[np.bool_], Notes]:
    """Which rows have a time: a stamp of 0 between others, or before a date, was never set."""
    t = np.asarray(table.columns["t"], dtype=float)
    timed = ~np.isnan(t)
    zero = t == 0.0
    others = t[timed & ~zero]
    if zero.any() and len(others) > 1 and zero.sum() < len(others) and (others[1:] > others[:-1]).all():
        # A log may start at 0, but then its other times are not seconds since 1970; or count down to 0 and on.
        at_start = np.cumsum(timed & ~zero) == 0
        before = others[np.maximum(np.cumsum(timed & ~zero) - 1, 0)]
        timed &= ~(zero & np.where(at_start, others[0] > SINCE_1970, before > 0.0))
    lost = ~timed
    if not lost.any():
        return timed, []
    first = int(np.flatnonzero(lost)[0])
    note = {
        "name": "rows_without_time",
        "text": f"{lost.sum()} of {len(table)} rows have no time, or the time 0 among others, the first of them row "
        f"{table.line(first)}",
        "action": "these rows are left out",
        "value": int(lost.sum()),
        "severity": "warning" if lost.mean() > MANY else "info",
    }
    return timed, [note]


def _in_turns(
    table: Table, needed: Sequence[str], has: NDArray[np.bool_], rarest: int, notes: Notes
) -> tuple[Table, NDArray[np.intp], Notes]:
    """Interpolates the other needed columns to the times of the rarest one."""
    t = np.asarray(table.columns["t"], dtype=float)
    base = has[:, rarest].copy()
    columns = dict(table.columns)
    moved = []
    for name, own in zip(needed, has.T, strict=True):
        if own[base].all():
            continue
        times, values = t[own], table.columns[name][own]
        if len(times) < 2 or not (np.diff(times) > 0).all():
            raise InputError(
                f"only {several(len(times), 'row')} of {len(table)} with a number, at times that do not increase",
                file=table.path,
                column=name,
                allowed="numbers in rows whose times increase",
                remedy="record all signals at the same times, or resample them to the same times",
            )
        after = np.clip(np.searchsorted(times, t, side="left"), 1, len(times) - 1)
        near = (t >= times[0]) & (t <= times[-1])
        near &= times[after] - times[after - 1] <= STEPS * np.median(np.diff(times))
        base &= own | near
        columns[name] = np.where(own, table.columns[name], np.interp(t, times, values))
        moved.append(name)
    kept = np.flatnonzero(base)
    if len(kept) < 2:
        raise InputError(
            f"columns with numbers at separate times: {', '.join(needed)}",
            file=table.path,
            column=needed[rarest],
            allowed="signals of the same stretch of time",
            remedy="record all signals at the same times",
        )
    note = {
        "name": "columns_in_turns",
        "text": f"{_listed(moved)} have their numbers in other rows than {needed[rarest]}",
        "action": f"they are interpolated linearly to the {len(kept)} times of {needed[rarest]}",
        "value": len(kept),
    }
    return _rows(replace(table, columns=columns), kept), kept, [*notes, note]


def _rows(table: Table, kept: NDArray[np.intp]) -> Table:
    return replace(table, columns={name: values[kept] for name, values in table.columns.items()})


def _listed(names: Sequence[str]) -> str:
    return ", ".join(names[:6]) + (f", ... ({len(names)} columns)" if len(names) > 6 else "")


def _prefix(name: str) -> str:
    parsed = parse_name(name)
    return "" if parsed is None else parsed[0].prefix

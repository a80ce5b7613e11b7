"""JSON as tables: one object a line (JSON lines), a list of objects, or one object of arrays."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from estimation.logs.readers.matlab_files import columns_of
from robots.common.errors import InputError
from robots.common.tables.table import Column, Table


def read_json(path: Path, wanted: Callable[[str], bool]) -> Table:
    """Reads rows that are objects: a list of k numbers is the columns ``name1`` to ``namek``, an object ``name.field``.

    Args:
        path: the file, UTF-8.
        wanted: selects by name which columns to keep; those hold numbers or nothing, or text in all rows.

    Raises:
        InputError: no JSON, no rows, or a column of numbers and text; with the line.
    """
    rows: list[dict[str, Any]] = []
    lines: list[int] = []
    for line, record in _records(path):
        if not isinstance(record, dict):
            raise InputError(f"found {str(record)[:40]}", file=path, row=line, allowed="an object with names")
        rows.append(dict(_flat(record)))
        lines.append(line)
    if len(rows) == 1 and any(isinstance(value, list) for value in rows[0].values()):
        return _of_arrays(path, rows[0], wanted)
    if not rows:
        raise InputError("no rows", file=path, allowed="one object a line")
    split = [dict(_split(row)) for row in rows]
    names = list(dict.fromkeys(name for row in split for name in row))
    kept = [name for name in names if wanted(name)]
    return Table(
        columns={name: _column(path, name, [row.get(name) for row in split], lines) for name in kept},
        metadata={},
        path=path,
        first_row=lines[0],
        skipped=tuple(name for name in names if name not in kept),
    )


def _records(path: Path) -> Iterator[tuple[int, Any]]:
    """Gives the rows with their lines, counted from 1; the rows of a list are counted instead."""
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError("the text is not UTF-8", file=path, remedy="save the file as UTF-8") from error
    if not text.strip():
        raise InputError("the file is empty", file=path)
    try:
        whole = json.loads(text)
    except ValueError:
        for number, line in enumerate(text.splitlines(), start=1):
            if line.strip():
                yield number, _loaded(line, path, number)
        return
    if isinstance(whole, dict):
        lists = [v for v in whole.values() if isinstance(v, list) and v and all(isinstance(x, dict) for x in v)]
        # What stands beside the only list of records describes the recording.
        whole = lists[0] if len(lists) == 1 else whole
    yield from enumerate(whole if isinstance(whole, list) else [whole], start=1)


def _loaded(line: str, path: Path, number: int) -> Any:
    try:
        return json.loads(line.strip().rstrip(","))
    except ValueError as error:
        raise InputError(
            f"not JSON ({error})",
            file=path,
            row=number,
            allowed="one whole object a line",
            remedy="remove the line; the last one is often cut off",
        ) from error


def _flat(record: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    for name, value in record.items():
        if isinstance(value, dict):
            yield from _flat(value, f"{prefix}{name}.")
        else:
            yield f"{prefix}{name}", value


def _split(row: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """Makes one column of each number of a list; lists of anything else are left out."""
    for name, value in row.items():
        if not isinstance(value, list):
            yield name, value
        elif all(item is None or isinstance(item, bool | int | float) for item in value):
            yield from ((f"{name}{k}", item) for k, item in enumerate(value, start=1))


def _column(path: Path, name: str, values: list[Any], lines: list[int]) -> Column:
    is_text = isinstance(next((value for value in values if value is not None), None), str)
    for value, line in zip(values, lines, strict=True):
        if value is not None and isinstance(value, str) != is_text:
            raise InputError(
                f"found {str(value)[:40]!r}",
                file=path,
                column=name,
                row=line,
                allowed="text in all rows" if is_text else "a number",
            )
    if is_text:
        return np.array(["" if value is None else value for value in values], dtype=object)
    return np.array([np.nan if value is None else value for value in values], dtype=np.float64)


def _of_arrays(path: Path, record: Mapping[str, Any], wanted: Callable[[str], bool]) -> Table:
    arrays = {}
    for name, value in record.items():
        try:
            arrays[name] = np.array(value, dtype=np.float64)
        except (ValueError, TypeError):
            continue
    return columns_of(arrays, path, wanted)

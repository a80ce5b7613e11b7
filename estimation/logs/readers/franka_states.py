"""Robot states that libfranka prints (``std::cout << state``), one JSON object a line, as tables."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from robots.common.errors import InputError
from robots.common.tables.table import Table

MARK = b'"tau_J"'
HEAD = 2**14


def is_franka_states(head: bytes) -> bool:
    """Whether a file begins with a printed robot state.

    Args:
        head: its first `HEAD` bytes.
    """
    begin = head.find(b"{")
    return begin >= 0 and MARK in head[begin:]


def franka_names(path: Path) -> list[str]:
    """Lists the columns of the first state: a field of k values has columns from ``field[0]`` on."""
    for _, state in _states(path):
        return list(_flat(path, 1, state))
    raise InputError("no robot state", file=path)


def read_franka_states(path: Path, wanted: Callable[[str], bool]) -> Table:
    """Reads the numbers of printed robot states.

    Lines without a state are left out, such as a greeting at the start.

    Args:
        path: the file.
        wanted: selects by name which columns to keep.

    Raises:
        InputError: a line that was cut, or states with other fields than the first.
    """
    rows: list[list[float]] = []
    first, names, kept = 1, [], []
    for number, state in _states(path):
        flat = _flat(path, number, state)
        if not rows:
            first, names = number, list(flat)
            kept = [name for name in names if wanted(name)]
        row = []
        for name in kept:
            if name not in flat:
                raise InputError(
                    "the state has no such field", file=path, column=name, row=number, remedy="remove the line"
                )
            row.append(flat[name])
        rows.append(row)
    if not rows:
        raise InputError("no robot state", file=path)
    values = np.array(rows, dtype=np.float64)
    return Table(
        columns={name: values[:, index].copy() for index, name in enumerate(kept)},
        metadata={},
        path=path,
        first_row=first,
        skipped=tuple(name for name in names if name not in kept),
    )


def _states(path: Path) -> Iterator[tuple[int, dict[str, Any]]]:
    with path.open(encoding="utf-8", errors="replace") as stream:
        for number, line in enumerate(stream, start=1):
            text = line.strip().rstrip(",")
            if not text.startswith("{"):
                continue
            try:
                state = json.loads(text)
            except ValueError as error:
                raise InputError(
                    f"the robot state cannot be read ({error})",
                    file=path,
                    row=number,
                    allowed="one whole state a line, as libfranka prints it",
                    remedy="remove the line; the last one is often cut off",
                ) from error
            yield number, state


def _flat(path: Path, row: int, state: dict[str, Any]) -> dict[str, float]:
    flat: dict[str, float] = {}
    for name, value in state.items():
        values = value if isinstance(value, list) else [value]
        for index, item in enumerate(values):
            column = f"{name}[{index}]" if isinstance(value, list) else name
            if isinstance(item, bool | int | float) or item is None:
                flat[column] = np.nan if item is None else float(item)
    return flat

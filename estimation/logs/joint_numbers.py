"""How the joints of a file are counted: from 1, as in a log, or from 0, as programmers do."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

from estimation.logs.columns import BY_FIELD, column_name, parse_name
from robots.common.errors import InputError
from robots.common.tables.table import Table

NAMES = "names_in_file"
"""Key of a table's metadata: the file's names of columns that were renamed."""

_POSITION = BY_FIELD["q"].prefix
_DIGITS = re.compile(r"\d+$")


def renamed_joints(names: Sequence[str], stated: Collection[str] = ()) -> dict[str, str]:
    """Names the columns of a log as if its joints were counted from 1, without leading zeros.

    A quantity with a column 0 is counted from 0. One without it is counted as the positions are, unless it has one
    column for each joint from 1 on.

    Args:
        names: of all columns of a file.
        stated: names whose meaning a mapping states; they stay.

    Returns:
        The log's name of each column that has another one; empty if two columns would get one name.
    """
    numbers: dict[str, set[int]] = {}
    parsed = {name: found for name in names if name not in stated and (found := parse_name(name)) is not None}
    for quantity, joint in parsed.values():
        if joint is not None:
            numbers.setdefault(quantity.prefix, set()).add(joint)
    positions = numbers.get(_POSITION, set())
    from_one = set(range(1, len(positions) + 1))
    zero = {
        prefix: 0 in found or (0 in positions and found != from_one and max(found) < len(positions))
        for prefix, found in numbers.items()
    }
    new = {
        name: column_name(quantity, None if joint is None else joint + zero[quantity.prefix])
        for name, (quantity, joint) in parsed.items()
    }
    taken = Counter([*new.values(), *(name for name in stated if name in names)])
    if any(count > 1 for count in taken.values()):
        return {}
    return {name: other for name, other in new.items() if other != name}


def counted_from_one(table: Table, stated: Collection[str] = ()) -> tuple[Table, dict[str, str], list[dict[str, Any]]]:
    """Renames the columns of a table whose joints are counted from 0.

    Args:
        table: as it was read.
        stated: names whose meaning a mapping states.

    Returns:
        The table, the file's name of each column that was renamed, and a note of it.
    """
    new = renamed_joints(table.names, stated)
    if not new:
        return table, {}, []
    columns = {new.get(name, name): values for name, values in table.columns.items()}
    units = {new.get(name, name): unit for name, unit in table.units.items()}
    prefixes = dict.fromkeys(_DIGITS.sub("", name) for name in new)
    read = []
    for prefix in prefixes:
        of = [name for name in new if _DIGITS.sub("", name) == prefix]
        read.append(
            f"{of[0]} to {of[-1]} as {new[of[0]]} to {new[of[-1]]}" if len(of) > 1 else f"{of[0]} as {new[of[0]]}"
        )
    note = {
        "name": "joint_numbers",
        "text": f"joints of the file are numbered otherwise: {', '.join(read)}",
        "action": "all findings and results count joints from 1; name the columns in a mapping if that is wrong",
        "value": len(new),
        "unit": "columns",
    }
    return replace(table, columns=columns, units=units), {other: name for name, other in new.items()}, [note]


@contextmanager
def named_as_in_file(names: Mapping[str, str]) -> Iterator[None]:
    """Makes errors name a column as the file does.

    Args:
        names: the file's name of each column that was renamed.
    """
    try:
        yield
    except InputError as error:
        error.column = names.get(error.column or "", error.column)
        raise

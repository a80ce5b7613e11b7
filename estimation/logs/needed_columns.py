"""Which columns a log needs; columns of other quantities are left out if something is wrong with them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from estimation.logs.columns import BY_FIELD, QUANTITIES, Quantity, parse_name
from estimation.logs.mappings.mapping import FIELDS
from robots.common.plain import joints_in_words, several
from robots.common.tables.table import Table

Notes = list[dict[str, Any]]

_BY_PREFIX = {quantity.prefix: quantity for quantity in QUANTITIES}
_WORDS = {BY_FIELD[field].prefix: key.replace("_", " ") for key, field in FIELDS.items()}
_DERIVED = ("dq", "ddq")
# A silent sensor of temperature is part of a log; an encoder behind a gear is there throughout, or not at all.
_MAY_MISS = ("temp", "temp_env")


def by_quantity(names: Sequence[str]) -> dict[str, list[str]]:
    """Sorts the columns of a log by the prefix of their quantity.

    Args:
        names: of columns; those that are no part of a log are left out.
    """
    found: dict[str, list[str]] = {}
    for name in names:
        parsed = parse_name(name)
        if parsed is not None:
            found.setdefault(parsed[0].prefix, []).append(name)
    return found


def needed_prefixes(names: Sequence[str]) -> set[str]:
    """Says which quantities a log cannot do without: time, positions, and torques, or currents in their place.

    All that reads logs asks this, so that only these columns can refuse one.

    Args:
        names: of the file's columns.
    """
    torque = BY_FIELD["tau"].prefix
    has_torque = torque in by_quantity(names)
    return {BY_FIELD["t"].prefix, BY_FIELD["q"].prefix, torque if has_torque else BY_FIELD["current"].prefix}


def is_needed(name: str, names: Sequence[str] | None) -> bool:
    """Whether a log with these columns needs the column of this name.

    Args:
        name: of one column.
        names: of all, where they are known.
    """
    parsed = parse_name(name)
    # An array of all joints has the name of its quantity.
    prefix = name if parsed is None else parsed[0].prefix
    return prefix in (("t", "q", "tau", "i") if names is None else needed_prefixes(names))


def without_faulty_extras(table: Table) -> tuple[Table, Notes]:
    """Leaves out quantities that no use needs and that have a fault: text, gaps, or joints without a column.

    A quantity without a single number is left out in any case, as if the file did not have it.

    Args:
        table: with the columns of a log.

    Returns:
        The table, and notes of what was left out.
    """
    notes: Notes = []
    dropped: set[str] = set()
    groups = by_quantity(table.names)
    for prefix, names in groups.items():
        if prefix not in ("t", "q", *_MAY_MISS) and all(_is_empty(table, name) for name in names):
            dropped.update(names)
            notes.append(_note(_BY_PREFIX[prefix], f"{_span(names)} without a single number", len(table), "empty"))
    needed = needed_prefixes([name for name in table.names if name not in dropped])
    joints = {_joint(name) for name in groups.get("q", ())}
    for prefix, names in groups.items():
        quantity = _BY_PREFIX[prefix]
        if prefix in needed or dropped & set(names):
            continue
        extra = [name for name in names if quantity.per_joint and _joint(name) not in joints]
        if joints and extra:
            dropped.update(extra)
            notes.append(
                _note(quantity, f"{_span(extra)}: the log has no position of that joint", len(extra), "joints")
            )
        fault = _fault(table, quantity, [name for name in names if name not in dropped], joints)
        if fault is not None:
            dropped.update(names)
            notes.append(_note(quantity, *fault))
    columns = {name: values for name, values in table.columns.items() if name not in dropped}
    return (replace(table, columns=columns) if dropped else table), notes


def _fault(table: Table, quantity: Quantity, names: Sequence[str], joints: set[int]) -> tuple[str, int, str] | None:
    """What keeps a quantity from being used: in words, in how many rows or joints, and the kind."""
    for name in names:
        if table.is_text(name):
            return f"{name} holds text ({str(table.columns[name][0])[:20]!r})", len(table), "text"
    if quantity.per_joint and quantity.complete and names:
        missing = sorted(joints - {_joint(name) for name in names})
        if missing:
            return f"no column of {quantity.prefix} for {joints_in_words(missing)}", len(missing), "joints"
    for name in names:
        values = table.columns[name]
        bad = ~np.isfinite(values)
        if quantity.prefix in _MAY_MISS or (quantity.prefix == "qlink" and np.isnan(values).all()):
            bad &= ~np.isnan(values)
        if bad.any():
            rows = np.flatnonzero(bad)
            return (
                f"{name} has no number in {several(len(rows), 'row')} of {len(table)}, the first of them row "
                f"{table.line(int(rows[0]))}",
                len(rows),
                "gaps",
            )
        if quantity.prefix in ("segment", "cycle") and (values != np.round(values)).any():
            row = int(np.flatnonzero(values != np.round(values))[0])
            return f"{name} is {values[row]:g} in row {table.line(row)}, which is no whole number", 1, "fraction"
    return None


def _note(quantity: Quantity, text: str, value: int, kind: str) -> dict[str, Any]:
    word = _WORDS[quantity.prefix]
    why = "; they are computed from the positions" if quantity.prefix in _DERIVED else ""
    return {
        "name": f"{word.replace(' ', '_')}_{kind}",
        "text": text,
        "action": f"the {word} columns are ignored{why}",
        "value": value,
        "unit": "joints" if kind == "joints" else "rows",
    }


def _joint(name: str) -> int:
    parsed = parse_name(name)
    return 0 if parsed is None or parsed[1] is None else parsed[1]


def _is_empty(table: Table, name: str) -> bool:
    return not table.is_text(name) and bool(np.isnan(table.columns[name]).all())


def _span(names: Sequence[str]) -> str:
    return names[0] if len(names) == 1 else f"{names[0]} to {names[-1]}"

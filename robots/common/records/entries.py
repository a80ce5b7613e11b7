"""What a record's file holds: its entries, and their values as plain data."""

from __future__ import annotations

import inspect
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass
from enum import Enum
from functools import cache
from os import PathLike
from typing import Any

import numpy as np


def plain(value: Any, **context: Any) -> Any:
    """Gives a value as plain data: records and dataclasses, arrays, sequences, mappings, enumerations and numbers.

    Args:
        value: the value.
        context: see `Record.to_dict`.
    """
    if value is None or isinstance(value, bool | str):
        return value
    if isinstance(value, Enum):
        return plain(value.value)
    if hasattr(type(value), "ENTRIES") and hasattr(value, "to_dict"):
        found = value.to_dict(**context)
        return list(found.values()) if value._as_list else found
    if is_dataclass(value):
        return written(value, context)
    if isinstance(value, tuple) and hasattr(value, "_asdict"):
        return plain(value._asdict(), **context)
    if isinstance(value, np.ndarray | np.generic):
        return plain(value.tolist())
    if isinstance(value, int):
        return value
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {str(key): plain(item, **context) for key, item in value.items()}
    if isinstance(value, PathLike):
        return str(value)
    items = list(value)
    # Long rows of numbers are most of a file.
    if all(type(item) is float for item in items):
        return [item if math.isfinite(item) else None for item in items]
    return [plain(item, **context) for item in items]


@dataclass(frozen=True)
class Entry:
    """One entry: its key, the paths of attributes whose values it holds, and whether it may be left out."""

    key: str
    paths: tuple[str, ...]
    unless_empty: bool

    def value(self, owner: object, context: Mapping[str, Any]) -> Any:
        """Gives the value of an owner, with what records above it share; a list of several attributes."""
        values = [value_at(owner, path, context) for path in self.paths]
        return values if len(values) > 1 else values[0]


@cache
def entries_of(kind: Any, whole: bool = False) -> tuple[Entry, ...]:
    """The entries of a class, in the order in which they are written; of a frozen one all fields on request."""
    listed = () if whole and _is_frozen(kind) else getattr(kind, "ENTRIES", ())
    found: dict[str, Entry] = {}
    for text in listed or ("*",):
        for part in [item.name for item in fields(kind)] if text == "*" else [text]:
            key, _, paths = part.partition("=")
            bare = key.removesuffix("?")
            found[bare] = Entry(bare, tuple((paths or bare.lstrip("*")).split(",")), key.endswith("?"))
    return tuple(found.values())


def has_fields(kind: Any) -> bool:
    """Says whether a class is a dataclass."""
    return hasattr(kind, "__dataclass_fields__")


def _is_frozen(kind: Any) -> bool:
    settings = getattr(kind, "__dataclass_params__", None)
    return settings is not None and bool(settings.frozen)


def value_at(owner: Any, path: str, context: Mapping[str, Any]) -> Any:
    """Follows the path of an entry from its owner.

    Args:
        owner: a record.
        path: as `Record.ENTRIES` has it.
        context: what records above it share.
    """
    found = owner
    for step in path.removesuffix("?").split("."):
        if found is None:
            return None
        name, *indices = step.replace("]", "").split("[")
        found = getattr(found, name) if hasattr(found, name) else context[name]
        if inspect.ismethod(found):
            names = inspect.signature(found).parameters
            found = found(**{name: context[name] for name in names if name in context})
        elif inspect.isbuiltin(found):
            found = found()
        for index in indices:
            place = index if isinstance(found, Mapping) else int(index) if index.isdigit() else getattr(owner, index)
            found = None if place is None else found[place]
    return None if path.endswith("?") and not found else found


def written(owner: Any, context: Mapping[str, Any]) -> dict[str, Any]:
    """Gives the entries of an owner as plain data.

    Args:
        owner: a record, or another dataclass.
        context: what records above it share.
    """
    data: dict[str, Any] = {}
    kind: Any = type(owner)
    for entry in entries_of(kind, context.get("whole", False)):
        value = entry.value(owner, context)
        if entry.unless_empty and (value is None or (isinstance(value, Sequence | Mapping) and not value)):
            continue
        if entry.key.startswith("**"):
            data |= plain(value, **context)
            continue
        *outer, last = entry.key.split(".")
        inside = data
        for key in outer:
            inside = inside.setdefault(key, {})
        inside[last] = plain(value, **context)
    return data

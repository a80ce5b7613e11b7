"""Values of a file, read as the kinds that a class states; each that does not fit is named with its place."""

from __future__ import annotations

import json
import math
import re
import types
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import MISSING, fields
from enum import Enum
from functools import cache
from os import PathLike
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

import numpy as np

from robots.common.errors import InputError
from robots.common.records.entries import entries_of, has_fields


def read_null_as(*numbers: float) -> dict[str, Any]:
    """Gives the metadata of a field whose null is another number than NaN.

    Args:
        numbers: one for all numbers of the field, or one for each place of a tuple.
    """
    return {"null": numbers}


def read(
    kind: Any,
    data: object,
    column: str = "",
    *,
    file: str | PathLike[str] | None = None,
    remedy: str = "",
    whole: bool = False,
) -> Any:
    """Reads a value of any kind that `plain` writes.

    Args:
        kind: its type, such as ``tuple[Contact, ...]``.
        data: plain data.
        column: the entry that holds them, for messages.
        file: in which they were found, for messages.
        remedy: what to do if they are damaged.
        whole: whether records hold all fields, whatever `Record.ENTRIES` lists.

    Raises:
        InputError: an entry that is missing or of another kind, named with the file.
    """
    return Reader(file=file, remedy=remedy, whole=whole).value(kind, data, column)


class Reader:
    """Reads values of one file, and says of each that does not fit where it stands."""

    def __init__(self, *, file: str | PathLike[str] | None, remedy: str, whole: bool = False) -> None:
        self.file, self.remedy, self.whole = file, remedy, whole

    def fail(self, path: str, problem: str, allowed: str = "") -> InputError:
        """Makes the error of an entry."""
        return InputError(
            problem,
            file=self.file,
            column=path or None,
            allowed=allowed or None,
            remedy=self.remedy or None,
            kind="damaged_result",
        )

    def record(self, kind: Any, data: object, path: str, given: Mapping[str, Any]) -> object:
        """Builds a dataclass, or another class with entries, of a JSON object."""
        if getattr(kind, "_as_list", False) and isinstance(data, list):
            data = {entry.key: item for entry, item in zip(entries_of(kind, self.whole), data, strict=False)}
        if not isinstance(data, Mapping):
            raise self.fail(path, f"found {_short(data)}", "an object")
        if not has_fields(kind):
            made = kind(**given) if given else kind.__new__(kind)
            for name, value in self.values(kind, data, path, frozenset(), frozenset()):
                setattr(made, name, value)
            return made
        optional = {i.name for i in fields(kind) if i.default is not MISSING or i.default_factory is not MISSING}
        found = dict(self.values(kind, data, path, frozenset(given), frozenset(optional))) | dict(given)
        lacking = [i.name for i in fields(kind) if i.init and i.name not in optional and i.name not in found]
        if lacking:
            raise InputError(
                f"{kind.__name__}: its JSON does not hold all of it ({', '.join(lacking)})",
                file=self.file,
                remedy="read its folder by the load function, or keep the object",
                kind="damaged_result",
            )
        return kind(**found)

    def values(
        self, kind: Any, data: Mapping[str, Any], path: str, given: frozenset[str], optional: frozenset[str]
    ) -> Iterator[tuple[str, Any]]:
        """Reads the entries that are attributes with a type that the class states."""
        hints = _hints(kind)
        nulls = {item.name: item.metadata.get("null", ()) for item in fields(kind)} if has_fields(kind) else {}
        parts: dict[str, list[Any]] = {}
        inner: dict[str, dict[str, Any]] = {}
        for entry in entries_of(kind, self.whole):
            here = f"{path}.{entry.key}" if path else entry.key
            found = _inside(data, entry.key)
            for place, text in enumerate(entry.paths):
                name, index = _item(text)
                outer, _, within = text.partition(".")
                if within and outer in nulls and outer not in given and found is not MISSING:
                    inner.setdefault(outer, {})[within] = found
                if name not in hints or name in given or (has_fields(kind) and name not in nulls):
                    continue
                if found is MISSING and name not in optional and not (entry.unless_empty and not has_fields(kind)):
                    raise self.fail(here, "is missing")
                if found is MISSING:
                    continue
                item, hint = found, hints[name]
                if index:
                    parts.setdefault(name, []).append(self.value(get_args(hint)[int(index)], found, here))
                    if len(parts[name]) == len(get_args(hint)):
                        yield name, tuple(parts[name])
                    continue
                if len(entry.paths) > 1:
                    if not isinstance(found, list) or len(found) != len(entry.paths):
                        raise self.fail(here, f"found {_short(found)}", f"a list of {len(entry.paths)}")
                    item = found[place]
                yield name, self.value(hint, item, here, nulls.get(name, ()))
        for name, stated in inner.items():
            # A record whose fields are all entries of this one.
            if has_fields(hints[name]) and {item.name for item in fields(hints[name])} <= stated.keys():
                yield name, self.record(hints[name], stated, path, {})

    def value(self, hint: Any, data: Any, path: str, null: Sequence[float] = ()) -> Any:
        """Reads one value of the kind that a hint states."""
        origin, args = get_origin(hint), get_args(hint)
        if hint is Any or hint is object:
            return data
        if origin in (Union, types.UnionType):
            return self._union(args, data, path, null)
        if origin is Literal:
            if data not in args:
                raise self.fail(path, f"found {_short(data)}", ", ".join(map(str, args)))
            return data
        if origin is np.ndarray:
            return self._array(get_args(args[1])[0], data, path, null)
        if origin in (tuple, list) or (isinstance(origin, type) and issubclass(origin, Sequence)):
            return self._sequence(origin, args, data, path, null)
        if origin is dict or (isinstance(origin, type) and issubclass(origin, Mapping)):
            if not isinstance(data, Mapping):
                raise self.fail(path, f"found {_short(data)}", "an object")
            return {key: self.value(args[1], item, f"{path}.{key}", null) for key, item in data.items()}
        if hint is float:
            if data is None:
                return null[0] if null else math.nan
            if isinstance(data, int | float) and not isinstance(data, bool):
                return float(data)
            raise self.fail(path, f"found {_short(data)}", "a number")
        if hint is int and isinstance(data, float) and data.is_integer():
            return int(data)
        if hint in (int, str, bool, dict, type(None)):
            if not isinstance(data, hint) or (hint is int and isinstance(data, bool)):
                raise self.fail(path, f"found {_short(data)}", _KINDS[hint])
            return data
        if isinstance(hint, type) and issubclass(hint, Enum):
            try:
                return hint(data)
            except ValueError:
                raise self.fail(path, f"found {_short(data)}", ", ".join(str(item.value) for item in hint)) from None
        if isinstance(hint, type) and (has_fields(hint) or hasattr(hint, "ENTRIES")):
            return self.record(hint, data, path, {})
        raise TypeError(f"{path}: values of {hint} cannot be read")

    def _union(self, args: tuple[Any, ...], data: Any, path: str, null: Sequence[float]) -> Any:
        if data is None and type(None) in args:
            return None
        last: InputError | None = None
        for kind in args:
            if kind is type(None):
                continue
            try:
                return self.value(kind, data, path, null)
            except InputError as error:
                last = error
        assert last is not None
        raise last

    def _sequence(self, origin: Any, args: tuple[Any, ...], data: Any, path: str, null: Sequence[float]) -> Any:
        if not isinstance(data, list | tuple):
            raise self.fail(path, f"found {_short(data)}", "a list")
        if origin is list and args == (float,) and all(type(item) is float for item in data):
            return list(data)
        if origin is tuple and args[-1] is not Ellipsis:
            if len(data) != len(args):
                raise self.fail(path, f"{len(data)} values", f"{len(args)}")
            kinds: Sequence[Any] = args
        else:
            kinds = [args[0]] * len(data)
        items = [
            self.value(kind, item, f"{path}[{k + 1}]", null[k : k + 1] if len(null) > 1 else null)
            for k, (kind, item) in enumerate(zip(kinds, data, strict=True))
        ]
        return tuple(items) if origin is not list else items

    def _array(self, dtype: Any, data: Any, path: str, null: Sequence[float]) -> Any:
        try:
            found = np.array(data, dtype=dtype)
        except (TypeError, ValueError):
            raise self.fail(path, f"found {_short(data)}", "a list of numbers of one shape") from None
        return np.where(np.isnan(found), null[0], found) if null else found


def _item(path: str) -> tuple[str, str]:
    """Name and index of an attribute, or of one item of it; an empty name for what is only written."""
    found = re.fullmatch(r"(\w+)(?:\[(\d+)\])?", path)
    return ("", "") if found is None else (found[1], found[2] or "")


_KINDS = {int: "a whole number", str: "a text", bool: "true or false", dict: "an object", type(None): "null"}


@cache
def _hints(kind: Any) -> dict[str, Any]:
    return get_type_hints(kind)


def _inside(data: Mapping[str, Any], key: str) -> Any:
    found: Any = data
    for part in key.split("."):
        if not isinstance(found, Mapping) or part not in found:
            return MISSING
        found = found[part]
    return found


def _short(value: object) -> str:
    text = json.dumps(value) if not isinstance(value, float) or math.isfinite(value) else str(value)
    return text if len(text) <= 40 else f"{text[:37]}..."

"""Values of options in TOML: how they are read, and how they would be typed."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from oed.cli.declarations.declared import Declared
from robots.common.options import box, numbers, point

# Texts that may name a file, perhaps behind a number as in 2=payload.json or before arguments as in arm.xacro side:=l.
_FILE = re.compile(r"((?:\d+=)?)(.*(?:/|\.(?:json|csv|urdf|xacro|xml|mjcf|ya?ml)(?:$|\s)).*)", re.IGNORECASE)
_EXPECTED = {
    bool: "true or false",
    int: "a whole number",
    float: "a number",
    str: "a text in quotes",
    Path: "a path in quotes",
}


class WrongValueError(Exception):
    """A value that the option does not take; the message says what it takes."""


def typed_value(option: Declared, found: Any, folder: Path) -> Any:
    """Converts a value of a TOML file to what the parser makes of a typed one.

    Args:
        option: whose value it is.
        found: the value.
        folder: to which relative paths refer.

    Raises:
        WrongValueError: another type, or a number that is too small or too large.
    """
    if not option.several:
        return _single(option, found, folder)
    numbers = isinstance(found, list) and option.kind is str and all(_is_number(item) for item in found)
    items = found if isinstance(found, list) and not numbers else [found]
    return [_single(option, item, folder) for item in items]


def words_of(option: Declared, value: Any) -> list[str]:
    """Writes an option as on a command line.

    Args:
        option: the option.
        value: as `typed_value` gives it.
    """
    if option.kind is bool:
        name = option.name if value else option.negative
        return [f"--{name}"] if name else []
    texts = [str(item) for item in (value if option.several else [value])]
    pairs = ([f"--{option.name}={text}"] if text.startswith("-") else [f"--{option.name}", text] for text in texts)
    return [word for pair in pairs for word in pair]


def _single(option: Declared, found: Any, folder: Path) -> Any:
    kind, how = option.kind, option.how
    if kind is str and isinstance(found, list) and found and all(_is_number(item) for item in found):
        return ",".join(f"{item:.17g}" if isinstance(item, float) else str(item) for item in found)
    if kind is str and isinstance(found, str):
        match = _FILE.fullmatch(found) if how.names_file else None
        return match[1] + _beside(match[2], folder) if match else found
    if kind is Path and isinstance(found, str) and found:
        return _beside(found, folder)
    if kind is bool and isinstance(found, bool):
        return found
    if (kind is float and _is_number(found)) or (kind is int and type(found) is int):
        if how.least is not None and found < how.least:
            raise WrongValueError(f"{how.least:g} or more")
        if how.most is not None and found > how.most:
            raise WrongValueError(f"{how.most:g} or less")
        return kind(found)
    array = ", or an array of numbers" if how.reads in (numbers, point, box) else ""
    raise WrongValueError(_EXPECTED[kind] + array + (", or an array of them" if option.several else ""))


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _beside(path: str, folder: Path) -> str:
    return str(folder / Path(path).expanduser())

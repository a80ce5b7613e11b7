"""What options a command has, from its signature, and the reading of their values from TOML."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from types import NoneType, UnionType
from typing import Annotated, Any, get_args, get_origin, get_type_hints

# Texts that may name a file, perhaps behind a number as in 2=payload.json or before arguments as in arm.xacro side:=l.
_FILE = re.compile(r"((?:\d+=)?)(.*(?:/|\.(?:json|csv|urdf|xacro|xml|mjcf|ya?ml)(?:$|\s)).*)", re.IGNORECASE)
_MAY_BE_FILE = ("robot", "payload", "pose")
_EXPECTED = {
    bool: "true or false",
    int: "a whole number",
    float: "a number",
    str: "a text in quotes, or an array of numbers",
    Path: "a path in quotes",
}


class WrongValueError(Exception):
    """A value that the option does not take; the message says what it takes."""


@dataclass(frozen=True, kw_only=True)
class Option:
    """An option of one command.

    Attributes:
        name: without dashes, as it is typed, such as ``torque-is``.
        parameter: its name in Python, such as ``torque_is``.
        kind: bool, int, float, str or Path.
        several: whether it may be given again.
        least: the smallest number allowed, None without a limit.
        negative: how a flag is switched off, such as ``no-strokes``; None if leaving it out does so.
    """

    name: str
    parameter: str
    kind: type
    several: bool
    least: float | None
    negative: str | None

    def value(self, found: Any, folder: Path) -> Any:
        """Converts a value of a TOML file.

        Args:
            found: the value.
            folder: to which relative paths refer.

        Raises:
            WrongValueError: another type, or a number that is too small.
        """
        if not self.several:
            return self._single(found, folder)
        numbers = isinstance(found, list) and self.kind is str and all(_is_number(item) for item in found)
        items = found if isinstance(found, list) and not numbers else [found]
        return [self._single(item, folder) for item in items]

    def _single(self, found: Any, folder: Path) -> Any:
        if self.kind is str and isinstance(found, list) and found and all(_is_number(item) for item in found):
            return ",".join(f"{item:.17g}" if isinstance(item, float) else str(item) for item in found)
        if self.kind is str and isinstance(found, str):
            match = _FILE.fullmatch(found) if self.parameter in _MAY_BE_FILE else None
            return match[1] + _beside(match[2], folder) if match else found
        if self.kind is Path and isinstance(found, str) and found:
            return _beside(found, folder)
        if self.kind is bool and isinstance(found, bool):
            return found
        if (self.kind is float and _is_number(found)) or (self.kind is int and type(found) is int):
            if self.least is not None and found < self.least:
                raise WrongValueError(f"{self.least:g} or more")
            return self.kind(found)
        raise WrongValueError(_EXPECTED[self.kind] + (", or an array of them" if self.several else ""))

    def words(self, value: Any) -> list[str]:
        """Writes the option as on a command line.

        Args:
            value: as `value` gives it.
        """
        if self.kind is bool:
            name = self.name if value else self.negative
            return [f"--{name}"] if name else []
        texts = [str(item) for item in (value if self.several else [value])]
        pairs = ([f"--{self.name}={text}"] if text.startswith("-") else [f"--{self.name}", text] for text in texts)
        return [word for pair in pairs for word in pair]


def options_of(function: Callable[..., None]) -> dict[str, Option]:
    """Lists the options of a command by name, without its positional arguments.

    Args:
        function: the command, with annotations of typer.
    """
    found = {}
    for parameter, hint in get_type_hints(function, include_extras=True).items():
        if get_origin(hint) is not Annotated:
            continue
        annotation, info = get_args(hint)[:2]
        if type(info).__name__ != "OptionInfo":
            continue
        if isinstance(annotation, UnionType):
            annotation = next(part for part in get_args(annotation) if part is not NoneType)
        several = get_origin(annotation) is list
        kind = get_args(annotation)[0] if several else annotation
        plain = parameter.replace("_", "-")
        # Behind Annotated, typer keeps the first spelling where the default would be.
        spellings = [text for text in (info.default, *(info.param_decls or ())) if str(text).startswith("--")]
        spelling = spellings[0] if spellings else f"--{plain}/--no-{plain}" if kind is bool else plain
        name, _, negative = (part.strip().removeprefix("--") for part in spelling.partition("/"))
        found[name] = Option(
            name=name, parameter=parameter, kind=kind, several=several, least=info.min, negative=negative or None
        )
    return found


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _beside(path: str, folder: Path) -> str:
    return str(folder / Path(path).expanduser())

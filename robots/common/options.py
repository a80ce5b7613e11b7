"""What a command line needs to know of a field of an options class, beyond its name, type, default and docstring."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any

from robots.common.errors import InputError


@dataclass(frozen=True, kw_only=True)
class Option:
    """Stands behind a field's type, as in ``poses: Annotated[int, Option(least=1)] = 30``.

    Attributes:
        name: as it is typed, if not as the field.
        hidden: whether it is set in Python only.
        least: the smallest number allowed.
        most: the largest number allowed.
        shown: what stands for the value in the help, such as ``KG``.
        section: of the help, where it is not that of the class.
        argument: whether it is given by its place instead of its name.
        reads: makes the value of the option's name and its text, such as ``numbers`` of "1,2,3".
        typed: with `reads`: the default as it would be typed, if it is more than a list.
        several: with `reads`: whether the option may be given again.
        names_file: whether the text may name a file; its place is then relative to a configuration file that has it.
        switch: whether a flag that is off by default has a spelling that switches it off.
        degrees: whether an angle in radians is typed in degrees.
        without: of a group: fields that are no options here.
        defaults: of a group: fields with another default here, and these.
        choices: where the values are listed, as ``module:name`` of a collection or of a function that gives one; a
            shell completes them, and other values may be allowed.
        only: the uses of the verb to which the option belongs, see `oed.cli.verbs.Verb.use`; of all if it is empty.
    """

    name: str | None = None
    hidden: bool = False
    least: float | None = None
    most: float | None = None
    shown: str | None = None
    section: str | None = None
    argument: bool = False
    reads: Callable[[str, str], Any] | None = None
    typed: str | None = None
    several: bool = False
    names_file: bool = False
    switch: bool = False
    degrees: bool = False
    without: tuple[str, ...] = ()
    defaults: tuple[tuple[str, Any], ...] = ()
    choices: str = ""
    only: tuple[str, ...] = ()


def numbers(option: str, text: str) -> tuple[float, ...]:
    """Reads comma-separated numbers.

    Args:
        option: for the message.
        text: as typed.

    Raises:
        InputError: the text is something else.
    """
    try:
        return tuple(float(part) for part in text.split(","))
    except ValueError:
        raise InputError(f"{option} {text}", allowed="numbers, separated by commas", kind="not_numbers") from None


def point(option: str, text: str) -> tuple[float, ...]:
    """Reads three numbers X,Y,Z.

    Args:
        option: for the message.
        text: as typed.

    Raises:
        InputError: the text is something else.
    """
    values = numbers(option, text)
    if len(values) != 3:
        raise InputError(f"{option} {text}", allowed="three numbers x, y, z", kind="not_numbers")
    return values


def box(option: str, text: str) -> tuple[float, ...]:
    """Reads a box xmin,xmax,ymin,ymax,zmin,zmax.

    Args:
        option: for the message.
        text: as typed.

    Raises:
        InputError: other than six numbers.
    """
    values = numbers(option, text)
    if len(values) != 6:
        allowed = "six numbers xmin,xmax,ymin,ymax,zmin,zmax, such as 0.1,0.6,-0.5,0.5,0.05,inf"
        raise InputError(f"{option} {text}", allowed=allowed, kind="not_numbers")
    return values


def names(option: str, text: str) -> tuple[str, ...]:
    """Reads comma-separated names.

    Args:
        option: for the message.
        text: as typed.
    """
    return tuple(part.strip() for part in text.split(",") if part.strip())


Numbers = Annotated[tuple[float, ...] | None, Option(reads=numbers)]
Point = Annotated[tuple[float, ...] | None, Option(reads=point)]
Names = Annotated[tuple[str, ...] | None, Option(reads=names)]
Seed = Annotated[int, Option(least=0)]

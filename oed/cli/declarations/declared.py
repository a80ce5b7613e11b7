"""The options that the fields of a class declare: name and type, default, and the text of the docstring."""

from __future__ import annotations

import math
import re
import sys
from collections.abc import Iterable, Iterator
from dataclasses import MISSING, Field, dataclass, fields, is_dataclass, replace
from functools import cache
from importlib import import_module
from inspect import cleandoc
from pathlib import Path
from textwrap import dedent
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from robots.common.options import Option

KINDS = (bool, int, float, str, Path)
SETTINGS, INPUT = "Settings", "Input"

_ATTRIBUTES = re.compile(r"^(?:Attributes|Args):\n((?: {4}.*\n?|\n)*)", re.MULTILINE)
_SHAPE = re.compile(r" \(\w+,\)")
_ENTRY = re.compile(r"^(\w+): ((?:.|\n)*?)(?=^\w+: |\Z)", re.MULTILINE)


@dataclass(frozen=True, kw_only=True)
class Declared:
    """One option of a command.

    Attributes:
        field: the name in Python, such as ``torque_is``.
        kind: of what is typed: bool, int, float, str or Path.
        several: whether it may be given again.
        default: of the typed value; MISSING if the option is required.
        help: one or more sentences.
        section: of the help.
        how: what the field says beyond its type.
        choices: all values of a type that lists them.
    """

    field: str
    kind: type
    several: bool
    default: Any
    help: str
    section: str
    how: Option
    choices: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """As it is typed, without dashes, such as ``torque-is``."""
        return self.how.name or self.field.strip("_").replace("_", "-")

    @property
    def required(self) -> bool:
        """Whether a command cannot run without it."""
        return self.default is MISSING

    @property
    def has_default(self) -> bool:
        """Whether there is a default to show."""
        return self.default not in (MISSING, None, (), "")

    @property
    def negative(self) -> str | None:
        """How a flag is switched off, such as ``no-strokes``; None if leaving it out does so."""
        switched = self.kind is bool and (self.default is not False or self.how.switch)
        return f"no-{self.name}" if switched else None

    def completed(self, begun: str) -> list[str]:
        """Lists the values that begin with what was typed so far, for a shell; empty where files may be meant."""
        known: Iterable[str] = self.choices
        if self.how.choices:
            module, _, name = self.how.choices.partition(":")
            found = getattr(import_module(module), name)
            known = found() if callable(found) else found
        return sorted(value for value in known if value.startswith(begun))

    def value(self, typed: Any) -> Any:
        """Gives the value of the field.

        Args:
            typed: the text, or what the parser made of it; several in a sequence; None without one.

        Raises:
            InputError: a text that the option cannot read.
        """
        if self.several:
            return tuple(self._read(item) for item in typed or ())
        return None if typed is None else self._read(typed)

    def _read(self, typed: Any) -> Any:
        if self.how.degrees:
            return math.radians(typed)
        return self.how.reads(f"--{self.name}", typed) if self.how.reads and isinstance(typed, str) else typed


def declared_options(cls: type) -> dict[str, Declared]:
    """Lists the options of a class and of the groups among its fields, by the names of the fields.

    Fields of other types than numbers, texts, paths and flags, or tuples of them, are no options. Groups may have a
    field of the same name, type and default: that is one option of all of them, described by the first.

    Args:
        cls: a dataclass; its docstring describes its fields under ``Attributes``.
    """
    return _declared_options(cls)


def group_of(cls: type, field: Field[Any]) -> type | None:
    """Gives the options class of a field that holds a group of options, or None; None for any other field."""
    hint, how = _split(cls, field)
    parts = [part for part in _parts(hint) if part is not NoneType]
    found = parts[0] if len(parts) == 1 and not how.hidden and how.reads is None else None
    return found if isinstance(found, type) and is_dataclass(found) else None


def required_fields(cls: type) -> list[str]:
    """Lists the fields of an options class that have no default."""
    return [field.name for field in fields(cls) if field.default is MISSING and field.default_factory is MISSING]


@cache
def _declared_options(cls: type) -> dict[str, Declared]:
    uses = getattr(cls, "uses", {})
    found: dict[str, Declared] = {}
    for item in _declared(cls, None, Option()):
        first = found.get(item.field, item)
        same = (first.kind, first.several) == (item.kind, item.several) and item.default in (first.default, MISSING)
        assert same, f"{cls.__name__} declares --{item.name} twice, with another type or default"
        only = dict.fromkeys((*first.how.only, *item.how.only)) if first.how.only and item.how.only else ()
        found[item.field] = replace(first, how=replace(first.how, only=tuple(only)))
    for item in found.values():
        named = [uses[use] for use in item.how.only if use in uses]
        before = f"{' or '.join(named).capitalize()}: " if named and len(named) == len(item.how.only) else ""
        text = item.help[:1].lower() + item.help[1:] if before and not item.help[1:2].isupper() else item.help
        found[item.field] = replace(item, help=before + text)
    return found


def is_option(cls: type, field: Field[Any]) -> bool:
    """Whether a field is one option.

    Args:
        cls: of the field.
        field: of a dataclass.
    """
    hint, how = _split(cls, field)
    return not how.hidden and _kind(hint, how) is not None


def _declared(cls: type, instance: Any, outer: Option) -> Iterator[Declared]:
    texts = _texts(cls)
    for field in fields(cls):
        if field.name in outer.without:
            continue
        hint, how = _split(cls, field)
        how = replace(how, only=how.only or outer.only, section=how.section or outer.section)
        default = field.default if instance is None else getattr(instance, field.name)
        default = dict(outer.defaults).get(field.name, default)
        group = group_of(cls, field)
        if group is not None:
            if default is None:
                how = replace(how, defaults=(*how.defaults, *((name, None) for name in required_fields(group))))
            yield from _declared(group, None if default is MISSING else default, how)
            continue
        read = None if how.hidden else _kind(hint, how)
        if read is None:
            continue
        kind, several = read
        if default is MISSING and callable(field.default_factory) and not how.typed:
            default = field.default_factory()
        if how.degrees and default is not MISSING:
            default = round(math.degrees(default), 9)
        section = how.section or getattr(cls, "section", None) or (INPUT if kind is Path else SETTINGS)
        yield Declared(
            field=field.name,
            kind=kind,
            several=several,
            default=how.typed or (default if default is MISSING or not how.reads else _text(default, several)),
            help=texts.get(field.name, ""),
            section="Arguments" if how.argument else section,
            how=how,
            choices=tuple(
                str(value)
                for part in (hint, *get_args(hint))
                if get_origin(part) is Literal
                for value in get_args(part)
            ),
        )


def _split(cls: type, field: Field[Any]) -> tuple[Any, Option]:
    """The type of a field, and what is said behind it."""
    hint = _hint(cls, field)
    how = next((part for part in getattr(hint, "__metadata__", ()) if isinstance(part, Option)), Option())
    return (get_args(hint)[0] if get_origin(hint) is Annotated else hint), how


def _hint(cls: type, field: Field[Any]) -> Any:
    """The type of a field; None for one that only type checkers know."""
    if not isinstance(field.type, str):
        return field.type
    owner = next(base for base in cls.__mro__ if field.name in vars(base).get("__annotations__", {}))
    try:
        return eval(field.type, vars(sys.modules[owner.__module__]))
    except NameError:
        return None


def _kind(hint: Any, how: Option) -> tuple[type, bool] | None:
    """What is typed: its kind, and whether several; None for a field that is no option."""
    if how.reads is not None:
        return str, how.several
    inner = next((part for part in _parts(hint) if part is not NoneType), None)
    several = get_origin(inner) is tuple and get_args(inner)[1:] == (...,)
    if several:
        inner = get_args(inner)[0]
    elif get_origin(inner) is Literal:
        inner = type(get_args(inner)[0])
    return (inner, several) if inner in KINDS else None


def _parts(hint: Any) -> tuple[Any, ...]:
    return get_args(hint) if get_origin(hint) in (Union, UnionType) else (hint,)


def _text(value: Any, several: bool) -> Any:
    """A default as it would be typed."""
    if value is None or isinstance(value, str):
        return value
    if several:
        return tuple(_text(item, False) for item in value)
    return ",".join(f"{item:g}" if isinstance(item, float) else str(item) for item in value)


def _texts(cls: type) -> dict[str, str]:
    """What the docstrings of a class and its bases say of its fields."""
    found: dict[str, str] = {}
    for base in reversed(cls.__mro__):
        block = _ATTRIBUTES.search(cleandoc(vars(base).get("__doc__") or ""))
        for name, text in _ENTRY.findall(dedent(block[1]) if block else ""):
            words = _SHAPE.sub("", " ".join(text.split()))
            # A name that is typed keeps its small letter.
            words = words if words.startswith("``") else words[:1].upper() + words[1:]
            found[name] = words.replace("``", "")
    return found

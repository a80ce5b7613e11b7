"""A command's options with the values of a command line and of the configuration file."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import MISSING, fields, replace
from typing import Any

from oed.cli.declarations.declared import Declared, declared_options, group_of, is_option, required_fields
from oed.cli.verbs import Verb
from robots.common.errors import InputError


def chosen(verb: type[Verb], context: Any) -> tuple[Verb, set[str]]:
    """Makes the options of a command.

    Values of the file that do not apply beside the others are left out; what was typed decides.

    Args:
        verb: the options class.
        context: of the command, its words parsed.

    Returns:
        The options, and the fields whose values come from the file.

    Raises:
        InputError: typed options that exclude each other, or a text that an option cannot read.
    """
    options = declared_options(verb)
    sources = {name: context.get_parameter_source(name) for name in options}
    typed = {name for name, source in sources.items() if source is not None and source.name == "COMMANDLINE"}
    filed = {name for name, source in sources.items() if source is not None and source.name == "DEFAULT_MAP"}
    values = {name: option.value(context.params[name]) for name, option in options.items()}
    values["typed"] = frozenset(typed)
    for first, second in _alternatives(verb):
        if {first, second} <= typed | filed:
            if (first in typed) == (second in typed):
                both = " and ".join(f"--{options[name].name}" for name in (first, second))
                raise InputError(f"{both} together", allowed="one of them", kind="options_together")
            _leave_out({second if first in typed else first}, options, values, filed)
    values["given"] = frozenset(typed | filed)
    made = _made(verb, None, values)
    unused = made.unused()
    wrong = [f"--{options[name].name}" for name in options if name in typed and name in unused]
    if wrong:
        raise made.refusal(wrong)
    if filed.intersection(unused):
        _leave_out(filed.intersection(unused), options, values, filed)
        values["given"] = frozenset(typed | filed)
        made = _made(verb, None, values)
    _require_complete(verb, made, {name: f"--{options[name].name}" for name in options}, typed)
    return made, filed


def _leave_out(
    names: Collection[str], options: Mapping[str, Declared], values: dict[str, Any], filed: set[str]
) -> None:
    for name in names:
        values[name] = options[name].value(options[name].default)
    filed -= set(names)


def _alternatives(cls: type) -> Iterator[tuple[str, str]]:
    yield from getattr(cls, "alternatives", ())
    for field in fields(cls):
        group = group_of(cls, field)
        if group is not None:
            yield from _alternatives(group)


def _require_complete(cls: type, made: Any, names: Mapping[str, str], typed: Collection[str]) -> None:
    """Refuses typed options of a group that is not there, for want of the one that it cannot be without."""
    for field in fields(cls):
        group, value = group_of(cls, field), getattr(made, field.name)
        if group is not None and value is not None:
            _require_complete(group, value, names, typed)
        elif group is not None:
            given = [names[item.name] for item in fields(group) if item.name in typed]
            if given:
                needed = ", ".join(names[name] for name in required_fields(group))
                verb = "needs" if len(given) == 1 else "need"
                raise InputError(
                    f"{' and '.join(given)} {verb} {needed}", remedy=f"add {needed}", kind="option_not_used"
                )


def _made(cls: type, instance: Any, values: Mapping[str, Any]) -> Any:
    """An options class with these values, and its groups with theirs."""
    made: dict[str, Any] = {}
    for field in fields(cls):
        group = group_of(cls, field)
        if group is not None:
            inner = field.default if instance is None else getattr(instance, field.name)
            if inner is None and any(values.get(name) is None for name in required_fields(group)):
                made[field.name] = None
            else:
                made[field.name] = _made(group, None if inner is MISSING else inner, values)
        elif field.name in values and (field.name in ("typed", "given") or is_option(cls, field)):
            made[field.name] = values[field.name]
    return cls(**made) if instance is None else replace(instance, **made)

"""The parser of a command, made of the options that its class declares."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from typing import Annotated, Any

import typer
from typer.main import get_command

from oed.cli.command import HELP, Command
from oed.cli.configuration.defaults import config_parameter
from oed.cli.declarations.declared import Declared, declared_options
from oed.cli.verbs import Verb


def parser_of(name: str, verbs: Mapping[str, type[Verb]]) -> Any:
    """Makes the parser of a command.

    Args:
        name: of the command.
        verbs: the options classes of all commands.
    """
    alone = typer.Typer(
        add_completion=False, pretty_exceptions_enable=False, rich_markup_mode=None, context_settings=HELP
    )
    alone.command(name, cls=Command)(_function(verbs[name]))
    made = get_command(alone)
    made.verb = verbs[name]  # type: ignore[attr-defined]
    made.params.append(config_parameter(verbs))
    return made


def _function(verb: type[Verb]) -> Callable[..., None]:
    """A function whose signature has the options: that is what typer makes a parser of."""

    def run(**_: Any) -> None: ...

    found = sorted(declared_options(verb).values(), key=lambda option: not option.how.argument)
    parameters = [_parameter(option) for option in found]
    run.__doc__ = inspect.getdoc(inspect.getmodule(verb))
    run.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    run.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
    return run


def _parameter(option: Declared) -> inspect.Parameter:
    how = option.how
    kind: Any = list[option.kind] if option.several else option.kind  # type: ignore[name-defined]
    settings: dict[str, Any] = {"help": option.help, "show_default": option.has_default, "metavar": how.shown}
    settings |= {"min": how.least, "max": how.most}
    if how.choices or option.choices:
        settings["autocompletion"] = lambda incomplete: option.completed(incomplete)
    if how.argument:
        info = typer.Argument(**settings)
    else:
        negative = option.negative
        info = typer.Option(f"--{option.name}" + (f"/--{negative}" if negative else ""), **settings)
    default = list(option.default) if option.several and not option.required and option.default else option.default
    return inspect.Parameter(
        option.field,
        inspect.Parameter.KEYWORD_ONLY,
        default=inspect.Parameter.empty if option.required else default or None if option.several else default,
        annotation=Annotated[kind if option.required else kind | None, info],
    )

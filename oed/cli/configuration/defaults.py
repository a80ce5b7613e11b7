"""The option ``--config`` of every command, and how a command takes its defaults from the file."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer
from typer.main import get_command

from robots.common.errors import InputError

if TYPE_CHECKING:
    from oed.cli.configuration.file import Configuration
    from oed.cli.configuration.options import Option

HELP_TEXT = (
    "Configuration file with defaults of options; none reads no file. Default: the file that OED_CONFIG names, or "
    "oed.toml in the working directory."
)
REPORTS_PROBLEMS = "doctor"
"""The command that runs in spite of a wrong file, to say what is wrong."""

FILE, PROBLEM, LEFT_OUT = "oed.configuration", "oed.configuration.problem", "oed.configuration.left_out"


def config_parameter(functions: Mapping[str, Callable[..., None]]) -> Any:
    """Makes the parser's ``--config``; reading it sets the command's defaults.

    Args:
        functions: all commands by name.
    """

    def load(context: typer.Context, value: str | None) -> str | None:
        if not context.resilient_parsing:
            given = value if value is not None else context.find_root().params.get("config")
            _load(context, given, functions)
        return value

    alone = typer.Typer(add_completion=False, rich_markup_mode=None)

    @alone.command()
    def _only(
        config: str | None = typer.Option(
            None,
            "--config",
            metavar="FILE",
            help=HELP_TEXT,
            show_default=False,
            is_eager=True,
            expose_value=False,
            callback=load,
        ),
    ) -> None: ...

    return get_command(alone).params[0]


def _load(context: Any, given: str | None, functions: Mapping[str, Callable[..., None]]) -> None:
    from oed.cli.configuration.file import find, read

    found, name = find(given), str(context.command.name)
    if found is None or name not in functions:
        return
    try:
        configuration = read(*found, functions)
        values = configuration.of(name)
    except InputError as error:
        if name != REPORTS_PROBLEMS:
            raise
        context.meta[PROBLEM] = error
        return
    context.meta[FILE] = configuration
    left_out = context.meta.get(LEFT_OUT, ())
    context.default_map = {
        option.parameter: value for option, value in values.items() if option.parameter not in left_out
    }


def is_from_file(context: Any, parameter: str) -> bool:
    """Whether the file gives the value of a parameter.

    Args:
        context: of the command, its words parsed.
        parameter: the name in Python.
    """
    source = context.get_parameter_source(parameter)
    return source is not None and source.name == "DEFAULT_MAP"


def used_options(context: Any) -> dict[Option, Any]:
    """Lists the options whose values come from the file.

    Args:
        context: of the command, its words parsed.
    """
    configuration: Configuration | None = context.meta.get(FILE)
    if configuration is None or not context.default_map:
        return {}
    return {
        option: value
        for option, value in configuration.of(str(context.command.name)).items()
        if is_from_file(context, option.parameter) and option.parameter in context.default_map
    }


def described(options: Mapping[Option, Any]) -> list[str]:
    """Writes options as the words of a command line.

    Args:
        options: with their values.
    """
    return [word for option, value in options.items() for word in option.words(value)]


def configuration_state(context: Any) -> dict[str, Any]:
    """Says which file was found, what named it, what it sets, and what is wrong with it.

    Args:
        context: of a command.
    """
    configuration: Configuration | None = context.meta.get(FILE)
    problem: InputError | None = context.meta.get(PROBLEM)
    if configuration is None:
        file = None if problem is None else problem.file
        return {"file": file, "origin": None, "keys": [], "problem": None if problem is None else str(problem)}
    keys = [*configuration.shared]
    keys += [f"{command}.{key}" for command, table in configuration.tables.items() for key in table]
    return {
        "file": str(Path(configuration.path).resolve()),
        "origin": configuration.origin,
        "keys": keys,
        "problem": None,
    }

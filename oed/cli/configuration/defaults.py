"""The option ``--config`` of every command, and how a command takes its defaults from the file."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from contextvars import ContextVar
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer
from typer.main import get_command

from robots.common.errors import InputError

if TYPE_CHECKING:
    from oed.cli.configuration.file import Configuration
    from oed.cli.verbs import Verb

HELP_TEXT = (
    "Configuration file with defaults of options; none reads no file. Default: the file that OED_CONFIG names, or "
    "oed.toml in the working directory."
)
REPORTS_PROBLEMS = "doctor"
"""The command that runs in spite of a wrong file, to say what is wrong."""


_READ: ContextVar[tuple[Configuration | None, InputError | None]] = ContextVar("read", default=(None, None))
"""The file of the running command, or what is wrong with it."""


def config_parameter(verbs: Mapping[str, type[Verb]]) -> Any:
    """Makes the parser's ``--config``; reading it sets the command's defaults.

    Args:
        verbs: the options classes of all commands by name.
    """

    def load(context: typer.Context, value: str | None) -> str | None:
        if not context.resilient_parsing:
            given = value if value is not None else context.find_root().params.get("config")
            _load(context, given, verbs)
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


def _load(context: Any, given: str | None, verbs: Mapping[str, type[Verb]]) -> None:
    from oed.cli.configuration.file import find, read

    found, name = find(given), str(context.command.name)
    _READ.set((None, None))
    if found is None or name not in verbs:
        return
    try:
        configuration = read(*found, verbs)
        values = configuration.of(name)
    except InputError as error:
        if name != REPORTS_PROBLEMS:
            raise
        _READ.set((None, error))
        return
    _READ.set((configuration, None))
    context.default_map = {option.field: value for option, value in values.items()}


def described(command: str, fields: Collection[str]) -> tuple[Path | None, list[str]]:
    """Writes the options that come from the file as the words of a command line.

    Args:
        command: its name.
        fields: of the options.

    Returns:
        The file and the words.
    """
    configuration, _ = _READ.get()
    if configuration is None or not fields:
        return None, []
    from oed.cli.configuration.values import words_of

    values = {option: value for option, value in configuration.of(command).items() if option.field in fields}
    return configuration.path, [word for option, value in values.items() for word in words_of(option, value)]


def configuration_state() -> dict[str, Any]:
    """Says which file was found, what named it, what it sets, and what is wrong with it."""
    configuration, problem = _READ.get()
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

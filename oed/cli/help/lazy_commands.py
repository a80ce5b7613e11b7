"""Commands whose parsers are made when they are asked for: that of all of them takes longer than the help."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator, MutableMapping
from typing import Any

import typer
from typer.main import get_command

from oed.cli.command import HELP, Command
from oed.cli.configuration.defaults import config_parameter


class LazyCommands(MutableMapping[str, Any]):
    """Parsers of commands by name.

    Args:
        functions: the commands, each with its help as docstring.
    """

    def __init__(self, functions: tuple[Callable[..., None], ...]) -> None:
        self._functions = {function.__name__.replace("_", "-"): function for function in functions}
        self._made: dict[str, Any] = {}

    def __getitem__(self, name: str) -> Any:
        if name not in self._made:
            alone = typer.Typer(
                add_completion=False, pretty_exceptions_enable=False, rich_markup_mode=None, context_settings=HELP
            )
            alone.command(name, cls=Command)(self._functions[name])
            made = get_command(alone)
            made.params.append(config_parameter(self._functions))
            self._made[name] = made
        return self._made[name]

    def __setitem__(self, name: str, command: Any) -> None:
        self._made[name] = command
        self._functions.setdefault(name, command)

    def __delitem__(self, name: str) -> None:
        del self._functions[name]
        self._made.pop(name, None)

    def __iter__(self) -> Iterator[str]:
        return iter(self._functions)

    def __len__(self) -> int:
        return len(self._functions)

    def summary(self, name: str) -> str:
        """Gives what a command does, in one line, without making its parser."""
        return (inspect.getdoc(self._functions[name]) or "").split("\n\n")[0].replace("\n", " ")

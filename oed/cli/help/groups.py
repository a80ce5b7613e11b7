"""The program itself: its commands by purpose, each made when it is asked for."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar

from typer.core import TyperGroup

from oed.cli.command import write_lines, write_sections
from oed.cli.help.help_texts import COMMANDS, FIRST, OTHER, group_of
from oed.cli.help.lazy_commands import LazyCommands


class Commands(TyperGroup):
    """All commands, by purpose.

    Attributes:
        functions: the commands, each with its help as docstring.
    """

    functions: ClassVar[tuple[Callable[..., None], ...]] = ()

    def __init__(self, **settings: Any) -> None:
        super().__init__(**settings)
        self.lazy = LazyCommands(self.functions)
        self.commands = self.lazy

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Writes the names of the commands and what they do."""
        sections: dict[str, list[tuple[str, str]]] = {title: [] for title in (*COMMANDS, OTHER)}
        for name in self.lazy:
            sections[group_of(COMMANDS, name, OTHER)].append((name, self.lazy.summary(name)))
        for title, names in COMMANDS.items():
            sections[title].sort(key=lambda row: names.index(row[0]))
        write_sections(formatter, sections.items())

    def format_epilog(self, ctx: Any, formatter: Any) -> None:
        """Writes what to do first."""
        write_lines(formatter, "First", FIRST)

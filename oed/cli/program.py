"""The program itself: its commands by purpose, each loaded when it is asked for."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, MutableMapping
from importlib import import_module
from importlib.util import find_spec
from typing import Any, ClassVar

from typer.core import TyperGroup

from oed.cli.command import write_lines, write_sections
from oed.cli.verbs import Verb

FIRST = (
    "oed example                writes files to try the commands on, and the next three commands",
    "oed COMMAND --help         options and examples of a command",
    "oed --install-completion   completes commands and options in your shell",
)
"""Lines at the end of the help of ``oed``."""

_SUMMARY = re.compile(r'"""(.*?)(?:\n\n|""")', re.DOTALL)


class Verbs(Mapping[str, type[Verb]]):
    """The options classes of commands by name, each in a module of its name.

    Args:
        modules: of the commands.
    """

    def __init__(self, modules: Mapping[str, str]) -> None:
        self._modules = modules

    def __getitem__(self, name: str) -> type[Verb]:
        found = getattr(import_module(self._modules[name]), name.capitalize())
        assert issubclass(found, Verb)
        return found

    def __iter__(self) -> Iterator[str]:
        return iter(self._modules)

    def __len__(self) -> int:
        return len(self._modules)

    def summary(self, name: str) -> str:
        """Gives the first sentence of a command's help: that of its module, which is not loaded for it."""
        loader: Any = getattr(find_spec(self._modules[name]), "loader", None)
        found = _SUMMARY.match(loader.get_source(self._modules[name]))
        return " ".join(found[1].split()) if found else ""


class Parsers(MutableMapping[str, Any]):
    """Parsers of commands by name.

    Args:
        verbs: the commands.
    """

    def __init__(self, verbs: Mapping[str, type[Verb]]) -> None:
        self._verbs = verbs
        self._made: dict[str, Any] = {}

    def __getitem__(self, name: str) -> Any:
        if name not in self._made:
            if name not in self._verbs:
                raise KeyError(name)
            from oed.cli.declarations.parsers import parser_of

            self._made[name] = parser_of(name, self._verbs)
        return self._made[name]

    def __setitem__(self, name: str, command: Any) -> None:
        self._made[name] = command

    def __delitem__(self, name: str) -> None:
        del self._made[name]

    def __iter__(self) -> Iterator[str]:
        return iter({**dict.fromkeys(self._verbs), **self._made})

    def __len__(self) -> int:
        return len(list(iter(self)))


class Program(TyperGroup):
    """All commands, by purpose.

    Attributes:
        purposes: names of commands by what they are for.
        verbs: the commands.
    """

    purposes: ClassVar[Mapping[str, tuple[str, ...]]]
    verbs: ClassVar[Verbs]

    def __init__(self, **settings: Any) -> None:
        super().__init__(**settings)
        self.commands = Parsers(self.verbs)

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Writes the names of the commands and what they do."""
        write_sections(
            formatter,
            ((title, [(name, self.verbs.summary(name)) for name in names]) for title, names in self.purposes.items()),
        )

    def format_epilog(self, ctx: Any, formatter: Any) -> None:
        """Writes what to do first."""
        write_lines(formatter, "First", FIRST)

"""Commands with help by purpose, examples, and options that take several values, as in ``--log runs/*.csv``."""

from __future__ import annotations

import re
import shlex
import sys
from collections.abc import Collection, Iterable, Iterator, Sequence
from typing import Any

from typer.core import TyperCommand

from oed.cli.declarations.declared import INPUT, SETTINGS, declared_options
from oed.cli.verbs import Verb

HELP = {"help_option_names": ["-h", "--help"]}
"""Settings of all commands: ``-h`` is ``--help``."""


LAST = ("--force", "--json", "--quiet", "--help")
"""Options of most commands, which stand at the end."""

# How typer writes the type of an option that may be given again.
_LISTS = re.compile(r"<list\[(\w+)\]>")


class Command(TyperCommand):
    """Reads ``--log a.csv b.csv`` as ``--log a.csv --log b.csv``, in commands without positional arguments."""

    verb: type[Verb]

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Parses the words of a command line."""
        again = {name for p in self.params if getattr(p, "multiple", False) for name in p.opts}
        if again and all(p.param_type_name == "option" for p in self.params):
            args = list(_repeated(args, again))
        return super().parse_args(ctx, list(args))

    def invoke(self, ctx: Any) -> Any:
        """Runs the command, and says which options come from the configuration file."""
        from oed.cli.configuration.defaults import described
        from oed.cli.console import Console
        from oed.cli.declarations.chosen import chosen
        from oed.reports.rendering.command_lines import completed_by

        verb, filed = chosen(self.verb, ctx)
        path, words = described(str(self.name), filed)
        if words and not verb.quiet:
            print(f"note: from {path}: {shlex.join(words)}", file=sys.stderr)
        console = Console(json=verb.json, quiet=verb.quiet, introduces=verb.introduces)
        with completed_by(words):
            with console.working(verb.kept) as progress:
                printed = verb.run(progress)
            if printed is not None:
                console.result(printed)

    def format_options(self, ctx: Any, formatter: Any) -> None:
        """Writes the options by purpose: robot, input, settings, output."""
        sections: dict[str, list[tuple[str, str]]] = {
            title: [] for title in ("Arguments", "Robot", "Input", SETTINGS, "Output")
        }
        sections_of = {name: option.section for name, option in declared_options(self.verb).items()} | {"config": INPUT}
        for parameter in self.get_params(ctx):
            record = parameter.get_help_record(ctx)
            if record is not None:
                argument = parameter.param_type_name == "argument"
                title = "Arguments" if argument else sections_of.get(str(parameter.name), "Output")
                sections[title].append((_LISTS.sub(lambda found: f"<{found[1].lower()}> ...", record[0]), record[1]))
        sections["Output"].sort(key=lambda row: next((k for k, name in enumerate(LAST, 1) if name in row[0]), 0))
        write_sections(formatter, sections.items())

    def format_epilog(self, ctx: Any, formatter: Any) -> None:
        """Writes examples to copy."""
        write_lines(formatter, "Examples", self.verb.examples)


def write_sections(formatter: Any, sections: Iterable[tuple[str, list[tuple[str, str]]]]) -> None:
    """Writes lists of names and what they mean, each under its title; empty ones are left out."""
    for title, rows in sections:
        if rows:
            with formatter.section(title):
                formatter.write_dl(rows)


def write_lines(formatter: Any, title: str, lines: Sequence[str]) -> None:
    """Writes lines as they are under a title."""
    if lines:
        with formatter.section(title):
            for line in lines:
                formatter.write(f"{'':>{formatter.current_indent}}{line}\n")


def _repeated(words: Sequence[str], again: Collection[str]) -> Iterator[str]:
    """Repeats an option before its second and later values."""
    option, values = "", 0
    for word in words:
        if word.startswith("-"):
            name, equals, _ = word.partition("=")
            option, values = (name if name in again else ""), int(bool(equals))
        elif option:
            values += 1
            if values > 1:
                yield option
        yield word

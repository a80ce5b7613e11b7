"""Commands with help by purpose, examples, and options that take several values, as in ``--log runs/*.csv``."""

from __future__ import annotations

import re
import shlex
import sys
from collections.abc import Collection, Iterable, Iterator, Sequence
from typing import Any

from typer.core import TyperCommand

from oed.cli.help.help_texts import EXAMPLES, OPTIONS, SETTINGS, group_of

HELP = {"help_option_names": ["-h", "--help"]}
"""Settings of all commands: ``-h`` is ``--help``."""


# How typer writes the type of an option that may be given again.
_LISTS = re.compile(r"<list\[(\w+)\]>")


class Command(TyperCommand):
    """Reads ``--log a.csv b.csv`` as ``--log a.csv --log b.csv``, in commands without positional arguments."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Parses the words of a command line."""
        again = {name for p in self.params if getattr(p, "multiple", False) for name in p.opts}
        if again and all(p.param_type_name == "option" for p in self.params):
            args = list(_repeated(args, again))
        left = super().parse_args(ctx, list(args))
        if ctx.default_map:
            from oed.cli.configuration.defaults import LEFT_OUT
            from oed.cli.configuration.exclusions import left_out

            unused = left_out(ctx)
            if unused:
                ctx.meta[LEFT_OUT] = unused
                ctx.params.clear()
                left = super().parse_args(ctx, list(args))
        return left

    def invoke(self, ctx: Any) -> Any:
        """Runs the command, and says which options come from the configuration file."""
        if not ctx.default_map:
            return super().invoke(ctx)
        from oed.cli.configuration.defaults import FILE, described, used_options
        from oed.reports.rendering.command_lines import completed_by

        words = described(used_options(ctx))
        if words and not ctx.params.get("quiet"):
            print(f"note: from {ctx.meta[FILE].path}: {shlex.join(words)}", file=sys.stderr)
        with completed_by(words):
            return super().invoke(ctx)

    def format_options(self, ctx: Any, formatter: Any) -> None:
        """Writes the options by purpose: robot, input, settings, output."""
        sections: dict[str, list[tuple[str, str]]] = {
            title: [] for title in ("Arguments", "Robot", "Input", SETTINGS, "Output")
        }
        for parameter in self.get_params(ctx):
            record = parameter.get_help_record(ctx)
            if record is not None:
                argument = parameter.param_type_name == "argument"
                title = "Arguments" if argument else group_of(OPTIONS, str(parameter.name), SETTINGS)
                sections[title].append((_LISTS.sub(r"<\1> ...", record[0]), record[1]))
        write_sections(formatter, sections.items())

    def format_epilog(self, ctx: Any, formatter: Any) -> None:
        """Writes examples to copy."""
        write_lines(formatter, "Examples", EXAMPLES.get(str(self.name), ()))


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

"""A command whose repeatable options also take several values, as in ``--log runs/*.csv``."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from typing import Any

from typer.core import TyperCommand


class Command(TyperCommand):
    """Reads ``--log a.csv b.csv`` as ``--log a.csv --log b.csv``, in commands without positional arguments."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Parses the words of a command line."""
        again = {name for p in self.params if getattr(p, "multiple", False) for name in p.opts}
        if again and all(p.param_type_name == "option" for p in self.params):
            args = list(_repeated(args, again))
        return super().parse_args(ctx, args)


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

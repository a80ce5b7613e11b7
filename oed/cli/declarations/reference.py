"""The options of a command as a table in Markdown, for the reference page."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from oed.cli.declarations.declared import Declared, declared_options
from oed.cli.verbs import Verb

COMMON = ("force", "json", "quiet")
"""Fields of most commands, which the page describes once."""


FUNCTIONS = "<!-- functions -->"
"""The place of the table of functions."""


def option_table(verb: type[Verb]) -> str:
    """Writes a row for each option that not all commands have: how it is typed, its default, what it means.

    Args:
        verb: options class of the command.
    """
    options = [option for name, option in declared_options(verb).items() if name not in COMMON]
    if not options:
        return ""
    options.sort(key=lambda option: (not option.how.argument, not option.required))
    rows = [f"| `{_spelling(option)}` | {_default(option)} | {_cell(option.help)} |" for option in options]
    return "\n".join(["| option | default | meaning |", "|---|---|---|", *rows, ""])


def with_option_tables(page: str, verbs: Mapping[str, type[Verb]]) -> str:
    """Puts tables into a page: of the functions, and of options in places such as ``<!-- options: design -->``.

    Args:
        page: in Markdown.
        verbs: the commands.
    """
    page = page.replace(FUNCTIONS, function_table(verbs)) if FUNCTIONS in page else page
    return re.sub(r"^<!-- options: (\w+) -->$", lambda found: option_table(verbs[found[1]]), page, flags=re.MULTILINE)


def function_table(verbs: Mapping[str, type[Verb]]) -> str:
    """Writes a row for each command that calls a public function.

    Args:
        verbs: the commands.
    """
    rows = [f"| `oed {name}` | `{verb.function}` |" for name, verb in verbs.items() if verb.function]
    return "\n".join(["| command | function |", "|---|---|", *rows])


def _spelling(option: Declared) -> str:
    if option.how.argument:
        return option.name.upper()
    return f"--{option.name}" + (f" / --{option.negative}" if option.negative else "")


def _default(option: Declared) -> str:
    value: Any = option.default
    if option.required:
        return "required"
    if isinstance(value, bool):
        return f"`--{option.name}`" if value else "-"
    return f"`{value}`" if option.has_default else "-"


def _cell(text: str) -> str:
    return text.replace("|", "\\|")

"""The message for a wrong command line: one line in the form of all other errors."""

from __future__ import annotations

import re
import sys
from collections.abc import Collection
from difflib import get_close_matches
from typing import Any

import typer

from robots.common.errors import ERROR_CODES

# The parser's classes are not public in all versions of typer; those above its error of a bad value are the same.
UsageError: type[Exception] = typer.BadParameter.__mro__[1]
CommandLineError: type[Exception] = typer.BadParameter.__mro__[2]

_COMMAND = re.compile(r"No such command '([^']*)'")
_EXTRA = re.compile(r"Got unexpected extra argument\S* \((.*)\)")
_NAME = re.compile(r"[A-Za-z][\w-]*")
_LAST_NAME = re.compile(r"(?:'|^--[\w-]+ )([A-Za-z][\w-]*)'?$")
_OPTION = re.compile(r"'(--?[\w-]+(?: / -\w)?)'")


def usage_message(error: Any) -> str:
    """Writes an error of the command line as one line, with the nearest right name and where to read on.

    Args:
        error: of the parser; it may have a context and the names that it knows.
    """
    context = getattr(error, "ctx", None)
    first = sys.argv[1] if len(sys.argv) > 1 and not sys.argv[1].startswith("-") else ""
    path = context.command_path if context is not None else f"oed {first}".strip()
    text = " ".join(str(_problem(error, context)).split()).rstrip(".")
    text = _OPTION.sub(r"\1", text[:1].lower() + text[1:])
    text = re.sub(r", unable to parse.*", "", text.replace(": Input should be ", ": it must be "))
    code = f" ({ERROR_CODES['unknown_option']})" if text.startswith(("no option", "no command")) else ""
    return f"{text}; see `{path} --help`{code}"


def _problem(error: Any, context: Any) -> str:
    wrong = getattr(error, "option_name", None)
    if wrong is not None and "such option" in str(error.message):
        known = [] if context is None else [name for p in context.command.get_params(context) for name in _spellings(p)]
        return f"no option {wrong}" + _nearest(wrong, known)
    command = _COMMAND.match(str(error.message))
    if command is not None:
        known = [] if context is None else list(context.command.commands)
        return f"no command {command[1]}" + (_nearest(command[1], known) or f"; allowed: {', '.join(known)}")
    extra = _EXTRA.match(str(error.message))
    if extra is not None and context is not None:
        logs = any("--log" in p.opts for p in context.command.get_params(context))
        return f"unexpected {extra[1]}" + ("; logs are given by --log" if logs else "")
    return str(error.format_message())


def _spellings(parameter: Any) -> list[str]:
    """Lists how an option is typed; of an argument nothing."""
    return [name for name in (*parameter.opts, *parameter.secondary_opts) if name.startswith("-")]


def _nearest(wrong: str, known: Collection[str]) -> str:
    close = nearest_name(wrong, known)
    return f"; did you mean {close}?" if close else ""


def with_nearest(problem: str, allowed: str | None, message: str) -> str:
    """Adds the nearest choice to a message about a wrong one.

    Args:
        problem: what was found; its last word is the wrong name.
        allowed: the choices, separated by commas.
        message: the whole message.

    Returns:
        The message, with the choice that was probably meant if one is near and none is named yet.
    """
    wrong = _LAST_NAME.search(problem)
    if wrong is None or allowed is None or "did you mean" in message:
        return message
    choices = [name for name in allowed.split(", ") if _NAME.fullmatch(name)]
    return message + (_nearest(wrong[1], choices) if wrong[1] not in choices else "")


def nearest_name(wrong: str, known: Collection[str]) -> str | None:
    """Finds the known name that was probably meant.

    Args:
        wrong: what was typed.
        known: all names.

    Returns:
        The most similar name, exchanged letters counting least; else one that begins alike; None where none is near.
    """
    typed = wrong.lower() if any("_" in name for name in known) else wrong.lower().replace("_", "-")
    close = get_close_matches(typed, known, n=3, cutoff=0.66)
    if not close:
        close = [name for name in known if name.lstrip("-").startswith(typed.lstrip("-"))]
    return min(close, key=lambda name: sorted(name) != sorted(typed), default=None)

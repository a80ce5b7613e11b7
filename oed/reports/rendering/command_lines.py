"""The command to repeat a result."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path

_ADDED: ContextVar[tuple[str, ...]] = ContextVar("added", default=())


@contextmanager
def completed_by(words: Sequence[str]) -> Iterator[None]:
    """Adds options that were not typed, because a configuration file gives them.

    The command to repeat then reads no such file: a later change of it makes no difference.

    Args:
        words: the options with their values.
    """
    token = _ADDED.set(tuple(words))
    try:
        yield
    finally:
        _ADDED.reset(token)


def command_words() -> list[str]:
    """Gives the words of the command line that was typed, completed by the options of the configuration file."""
    program = Path(sys.argv[0]).name
    # ``python -m oed`` runs a file of this name.
    words, added = ["oed" if program == "__main__.py" else program, *sys.argv[1:]], _ADDED.get()
    return [*_without_config(words), *added, "--config", "none"] if added else words


def written(words: Sequence[str]) -> str:
    """Writes a command line so that a shell reads these words."""
    return shlex.join(words)


def _without_config(words: Sequence[str]) -> Iterator[str]:
    remaining = iter(words)
    for word in remaining:
        if word == "--config":
            next(remaining, None)
        elif not word.startswith("--config="):
            yield word

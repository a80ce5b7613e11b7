"""Files that say how far unattended work has come: they are replaced as a whole."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any, TypeVar

from robots.common.errors import InputError
from robots.common.files import write_atomic

State = TypeVar("State")


def write_state(file: Path, form: str, state: Any) -> None:
    """Replaces the file of a state, a dataclass, with the name of its format."""
    data = {"format": form, "format_version": 1, **asdict(state)}
    write_atomic(file, json.dumps(data, indent=2, allow_nan=False) + "\n", force=True)


def read_state(file: Path, form: str, what: str, build: Callable[[dict[str, Any]], State]) -> State | None:
    """Reads the file of a state; None where there is none.

    Args:
        file: the file.
        form: name of its format.
        what: has this state, for the message.
        build: makes the state from the file's content.

    Raises:
        InputError: a file of another kind, or a damaged one.
    """
    if not file.exists():
        return None
    try:
        data = json.loads(file.read_text(encoding="utf-8"))
        if data["format"] != form:
            raise InputError(f"found the format {data['format']!r}", file=file, allowed=form)
        return build(data)
    except (OSError, UnicodeDecodeError, json.JSONDecodeError, KeyError, TypeError) as error:
        raise InputError(
            f"is damaged, or no state of {what}: {type(error).__name__} {error}",
            file=file,
            remedy="choose another folder",
        ) from error

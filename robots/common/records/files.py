"""JSON files of records: written whole or not at all, and checked for their format and version before they are read."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from os import PathLike
from pathlib import Path
from typing import Any

from robots.common.errors import InputError, OedError
from robots.common.files import existing_file, write_atomic


def write_json(path: str | PathLike[str], data: object, *, force: bool = False) -> None:
    """Writes plain data as a JSON file, whole or not at all.

    Args:
        path: the file.
        data: as `plain` gives them.
        force: replace a file that is there.

    Raises:
        InputError: the file is there, and force is not given, or it cannot be written.
    """
    write_atomic(path, json.dumps(data, indent=2, allow_nan=False) + "\n", force=force)


def read_json(
    path: str | PathLike[str], format: str = "", version: int | None = None, *, remedy: str
) -> dict[str, Any]:
    """Reads a JSON file with an object, of one format and of a version that is known.

    Args:
        path: the file.
        format: its format; any where it is empty.
        version: the newest that can be read.
        remedy: what to do about another file.

    Raises:
        InputError: no such file, no JSON object, or another format or a newer version.
    """
    kind = format.removeprefix("robot-oed ")
    wanted = f"is not {'an' if kind[0] in 'aeiou' else 'a'} {kind} file" if kind else "cannot be read as a JSON object"
    if not Path(path).exists():
        raise InputError("no such file", file=path, remedy=remedy, kind="no_such_file")
    try:
        data = json.loads(existing_file(path).read_text(encoding="utf-8"))
    except ValueError as error:
        raise InputError(f"{wanted} ({error})", file=path, remedy=remedy, kind="other_file") from error
    if not isinstance(data, dict) or (format and data.get("format") != format):
        allowed = f'"format": "{format}"' if format else None
        raise InputError(wanted, file=path, allowed=allowed, remedy=remedy, kind="other_file")
    found = data.get("format_version")
    if version is not None and (not isinstance(found, int) or found > version):
        raise InputError(
            f"format version {found!r}", file=path, allowed=f"up to {version}", remedy=remedy, kind="newer_version"
        )
    return data


@contextmanager
def damage_refused(file: str | PathLike[str] | None, *, remedy: str = "", entry: str = "") -> Iterator[None]:
    """Says what is wrong with a file in place of the errors that come of using its entries.

    Args:
        file: from which the entries are; None where a caller names it.
        remedy: what to do about it.
        entry: the one that is used.

    Raises:
        InputError: an entry that is missing, or of another kind.
    """
    try:
        yield
    except OedError as error:
        if error.file is not None:
            raise
        raise InputError(
            error.problem,
            file=file,
            column=error.column or entry or None,
            joint=error.joint,
            allowed=error.allowed,
            remedy=error.remedy or remedy or None,
            kind=error.kind or "damaged_result",
        ) from error
    except KeyError as error:
        missing = str(error.args[0])
        column = f"{entry}.{missing}" if entry and entry != missing else missing
        raise _damaged("is missing", file, column, remedy) from error
    except (AttributeError, IndexError, TypeError, ValueError) as error:
        raise _damaged("is damaged: it is of another kind", file, entry, remedy) from error


def _damaged(problem: str, file: str | PathLike[str] | None, column: str, remedy: str) -> InputError:
    return InputError(problem, file=file, column=column or None, remedy=remedy or None, kind="damaged_result")

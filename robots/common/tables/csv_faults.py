"""Where a CSV file is broken: a slow look at its lines, taken only after the fast reader has refused the file."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable, Sequence
from pathlib import Path

from robots.common.errors import InputError
from robots.common.tables.csv_dialects import PLAIN, Dialect, split_line

NULLS = ("", "nan", "NaN", "NAN", "-nan", "-NaN", "NA", "N/A", "n/a", "#N/A", "null", "NULL", "None")
"""Spellings of an empty cell in a column of numbers."""

_NUMBER = re.compile(r"\s*[+-]?(\d+\.?\d*([eE][+-]?\d+)?|\.\d+([eE][+-]?\d+)?|inf|infinity|nan)\s*", re.IGNORECASE)


def is_number(text: str, dialect: Dialect = PLAIN) -> bool:
    """Returns whether a cell can stand in a column of numbers; an empty one can."""
    if dialect.decimal == ",":
        if "." in text:
            return False
        text = text.replace(",", ".")
    return text in NULLS or _NUMBER.fullmatch(text) is not None


def check_names(names: Sequence[str], line: str, path: Path, row: int) -> None:
    """Checks the header of a CSV file.

    Args:
        names: the column names.
        line: the line that holds them.
        path: the file, for messages.
        row: its line number.

    Raises:
        InputError: no header, or names and rows with other separators.
    """
    if len(names) == 1 and " " in line.strip():
        raise InputError(
            "the names are separated by spaces, the rows are not",
            file=path,
            row=row,
            allowed="the same separator in all lines: commas, semicolons, tabs or spaces",
            remedy="export the file with commas as separators",
        )
    if all(is_number(name) for name in names):
        raise InputError(
            f"no header: the first line holds numbers ({line[:40].strip()})",
            file=path,
            row=row,
            allowed="a line of column names, then numbers",
            remedy="add the line of column names",
        )


def check_unique(names: Iterable[str], path: Path, row: int | None = None) -> None:
    """Checks that no column appears twice.

    Args:
        names: the column names.
        path: the file, for messages.
        row: the line of the header.

    Raises:
        InputError: a duplicate.
    """
    seen: set[str] = set()
    for name in names:
        if name in seen:
            raise named_twice(name, path, row)
        seen.add(name)


def named_twice(name: str, path: Path, row: int | None = None) -> InputError:
    """Returns the error of a column that appears twice."""
    return InputError("the column appears twice", file=path, column=name, row=row, remedy="rename or remove one")


def find_fault(
    lines: Iterable[bytes],
    names: Sequence[str],
    numeric: set[str],
    path: Path,
    first_row: int,
    dialect: Dialect = PLAIN,
) -> InputError:
    """Returns the first fault of the data lines as an error to raise.

    Args:
        lines: the data lines, without the header.
        names: all column names in order.
        numeric: the columns that must hold numbers.
        path: the file, for messages.
        first_row: the line number of the first of them.
        dialect: of the file.
    """
    checked = [(index, name) for index, name in enumerate(names) if name in numeric]
    for row, raw in enumerate(lines, start=first_row):
        line = raw.rstrip(b"\r\n").decode("utf-8", errors="replace")
        if "\ufffd" in line:
            return encoding_error(path, row)
        if not line.strip():
            return InputError("an empty line between the rows", file=path, row=row, remedy="remove it")
        if line.startswith("#"):
            return InputError(
                "a comment line below the header", file=path, row=row, remedy="move it to the head of the file"
            )
        try:
            cells = split_line(line, dialect)
        except csv.Error as error:
            return InputError(f"not a line of a CSV file ({error})", file=path, row=row)
        if len(cells) != len(names):
            return InputError(
                f"{len(cells)} cells, but the header has {len(names)} columns",
                file=path,
                row=row,
                allowed=f"{len(names)} cells",
                remedy="complete or remove the row",
            )
        for index, name in checked:
            if not is_number(cells[index], dialect):
                return InputError(
                    f"found {cells[index][:40]!r}",
                    file=path,
                    column=name,
                    row=row,
                    allowed="a number",
                    remedy="correct or remove the row",
                )
    return InputError("not a CSV file that can be read", file=path, allowed="separated numbers below one header")


def encoding_error(path: Path, row: int | None = None) -> InputError:
    """Returns the error of a file that is not UTF-8."""
    return InputError("the text is not UTF-8", file=path, row=row, allowed="UTF-8", remedy="save the file as UTF-8")

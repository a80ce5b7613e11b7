"""How a CSV file separates its cells and writes its decimals, found by looking at its first lines."""

from __future__ import annotations

import csv
import re
from dataclasses import dataclass
from pathlib import Path

from robots.common.errors import InputError

# A dialect is found from so many bytes of a file.
DIALECT_BYTES = 2**17
_DECIMAL_COMMA = re.compile(r'\s*"?[+-]?\d+,\d+([eE][+-]?\d+)?"?\s*')
_DECIMAL_POINT = re.compile(r'\s*"?[+-]?\d*\.\d+([eE][+-]?\d+)?"?\s*')
_SEPARATOR = re.compile(r"sep=(,|;|\t|\\t| )", re.IGNORECASE)
_WHITESPACE = re.compile(r"[ \t]+")


@dataclass(frozen=True)
class Dialect:
    """How cells are separated and decimals written.

    Attributes:
        delimiter: between cells: a comma, a semicolon, a tab or blanks.
        decimal: a point or a comma.
    """

    delimiter: str = ","
    decimal: str = "."


PLAIN = Dialect()


def stated_delimiter(line: str) -> str | None:
    """Gives the delimiter that a line ``sep=;`` states, as spreadsheets write it; None for another line."""
    match = _SEPARATOR.fullmatch(line.strip(" \r\n\ufeff") if "\t" in line else line.strip("\r\n\ufeff"))
    return None if match is None else match[1].replace("\\t", "\t")


def split_line(line: str, dialect: Dialect = PLAIN) -> list[str]:
    """Returns the cells of a line, quotes resolved; several blanks are one delimiter.

    Raises:
        csv.Error: a cell of more than 131,072 characters.
    """
    if dialect.delimiter == " ":
        line = _WHITESPACE.sub(" ", line.strip())
    return next(csv.reader([line], delimiter=dialect.delimiter), [])


def find_dialect(header: str, rows: str, path: Path, first_row: int, stated: str | None = None) -> Dialect:
    """Finds the dialect of a file from its header and first rows.

    A file without semicolons and tabs in its header is separated by commas, or by blanks if it has no commas either.
    Decimal commas are looked for where cells are not separated by commas, and in quoted cells.

    Args:
        header: the line of column names.
        rows: the beginning of the data.
        path: the file, for messages.
        first_row: the line number of the first row.
        stated: the delimiter that the file states.

    Raises:
        InputError: decimal commas and points side by side.
    """
    lines = rows.splitlines()[:200]
    delimiter = stated or _delimiter(header, lines)
    if delimiter == "," and not any('"' in line for line in lines[:2]):
        return PLAIN
    comma: int | None = None
    point: int | None = None
    for number, line in enumerate(lines, start=first_row):
        try:
            cells = split_line(line, Dialect(delimiter))
        except csv.Error:
            continue
        if comma is None and any(_DECIMAL_COMMA.fullmatch(cell) for cell in cells):
            comma = number
        if point is None and any(_DECIMAL_POINT.fullmatch(cell) for cell in cells):
            point = number
    if comma is not None and point is not None:
        raise InputError(
            f"decimal commas (line {comma}) and decimal points (line {point})",
            file=path,
            row=max(comma, point),
            allowed="one of the two in the whole file",
            remedy="export the file again",
        )
    return Dialect(delimiter, "." if comma is None else ",")


def _delimiter(header: str, lines: list[str]) -> str:
    for mark in (";", "\t"):
        if header.count(mark) > header.count(","):
            return mark
    words = header.split()
    first = next((line for line in lines if line.strip()), "")
    # A single column may have a name of several words.
    blanks = "," not in header and len(words) > 1 and len(first.split()) > 1 and "," not in first.rstrip(",")
    return " " if blanks else ","

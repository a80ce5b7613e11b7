"""How a CSV file separates its cells and writes its decimals, found by looking at its first lines."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from robots.common.errors import InputError

# Lines and bytes that are looked at.
LINES, BYTES = 200, 2**17
_DECIMAL_COMMA = re.compile(r'\s*"?[+-]?\d+,\d+([eE][+-]?\d+)?"?\s*')
_DECIMAL_POINT = re.compile(r'\s*"?[+-]?\d*\.\d+([eE][+-]?\d+)?"?\s*')


@dataclass(frozen=True)
class Dialect:
    """How cells are separated and decimals written.

    Attributes:
        delimiter: between cells: a comma, a semicolon or a tab.
        decimal: a point or a comma.
    """

    delimiter: str = ","
    decimal: str = "."


PLAIN = Dialect()


def find_dialect(header: str, rows: str, path: Path, first_row: int) -> Dialect:
    """Finds the dialect of a file from its header and first rows.

    A file without semicolons and tabs in its header is comma separated. Decimal commas are looked for only where cells
    are not separated by commas.

    Args:
        header: the line of column names.
        rows: the beginning of the data.
        path: the file, for messages.
        first_row: the line number of the first row.

    Raises:
        InputError: decimal commas and points side by side.
    """
    delimiter = next((mark for mark in (";", "\t") if header.count(mark) > header.count(",")), ",")
    if delimiter == ",":
        return PLAIN
    comma: int | None = None
    point: int | None = None
    for number, line in enumerate(rows.splitlines()[:LINES], start=first_row):
        cells = line.split(delimiter)
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

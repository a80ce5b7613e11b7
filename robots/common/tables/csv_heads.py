"""The head of a CSV file: a block of ``#`` lines, the delimiter, and the column names."""

from __future__ import annotations

import csv
import mmap
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

from robots.common.errors import InputError
from robots.common.tables.csv_dialects import DIALECT_BYTES, Dialect, find_dialect, split_line, stated_delimiter
from robots.common.tables.csv_faults import check_names, encoding_error, is_number
from robots.common.tables.ecsv import Header, parse_header

_UTF8_MARK = b"\xef\xbb\xbf"
_UNNAMED = "(unnamed "


@dataclass(frozen=True, kw_only=True)
class Head:
    """What stands above the data.

    Attributes:
        header: the content of the ``#`` block.
        names: the column names in order; a name that stands twice has its number behind it from the second on.
        twice: the names that stand twice or more.
        row: the line number of the names, counted from 1.
        start: the position of the data.
        first_row: the line number of the first row.
        dialect: of the file.
    """

    header: Header
    names: list[str]
    twice: frozenset[str]
    row: int
    start: int
    first_row: int
    dialect: Dialect


def is_unnamed(name: str) -> bool:
    """Whether a name stands for none: of row numbers in front, or of a delimiter at the end of each line."""
    return name.startswith(_UNNAMED)


def read_head(data: mmap.mmap | bytes, path: Path) -> Head:
    """Reads what stands above the data.

    The names may stand in the last ``#`` line, as ``numpy.savetxt`` writes them.

    Args:
        data: the file's bytes.
        path: the file, for messages.

    Raises:
        InputError: no header, text that is not UTF-8, or a column without a name.
    """
    block: list[str] = []
    stated: str | None = None
    position, row = (len(_UTF8_MARK) if data[: len(_UTF8_MARK)] == _UTF8_MARK else 0), 0
    while position < len(data):
        row += 1
        stop = data.find(b"\n", position)
        stop = len(data) if stop < 0 else stop + 1
        try:
            line = data[position:stop].decode("utf-8").rstrip("\r\n")
        except UnicodeDecodeError as error:
            raise encoding_error(path, row) from error
        begin, position = position, stop
        if line.startswith(("#", "% ")):
            block.append(line)
        elif row == 1 and (delimiter := stated_delimiter(line)) is not None:
            stated = delimiter
        elif line.strip():
            beginning = data[position : position + DIALECT_BYTES].decode("utf-8", errors="replace")
            dialect = find_dialect(line, beginning, path, row + 1, stated)
            names = _split(line, dialect, path, row)
            if all(is_number(name, dialect) for name in names):
                hidden = _names_in(block, len(names), dialect)
                if hidden is not None:
                    index, names = hidden
                    return _head(block[:index], names, path, row, begin, dialect)
            check_names(names, line, path, row)
            first = beginning.split("\n", 1)[0].rstrip("\r")
            names = _with_ends(names, split_line(first, dialect) if first.strip() else names, path, row)
            return _head(block, names, path, row + 1, position, dialect)
    raise InputError("no header and no data", file=path, allowed="a line of column names, then rows of numbers")


def _head(block: list[str], names: list[str], path: Path, first_row: int, start: int, dialect: Dialect) -> Head:
    counts = Counter(names)
    seen: Counter[str] = Counter()
    distinct = []
    for name in names:
        seen[name] += 1
        distinct.append(name if seen[name] == 1 else f"{name} ({seen[name]})")
    return Head(
        header=parse_header(block, path),
        names=distinct,
        twice=frozenset(name for name, count in counts.items() if count > 1),
        row=first_row - 1,
        start=start,
        first_row=first_row,
        dialect=dialect,
    )


def _split(line: str, dialect: Dialect, path: Path, row: int) -> list[str]:
    try:
        return [name.strip() for name in split_line(line, dialect)]
    except csv.Error as error:
        raise InputError(f"no header: {error}", file=path, row=row) from error


def _names_in(block: list[str], count: int, dialect: Dialect) -> tuple[int, list[str]] | None:
    """Finds names behind a ``#`` or a ``%``: the last line with as many different words as there are cells."""
    delimiters = dict.fromkeys((dialect.delimiter, ",", ";", "\t", " "))
    for index in range(len(block) - 1, -1, -1):
        for delimiter in delimiters:
            names = [name.strip() for name in split_line(block[index].lstrip("#%"), Dialect(delimiter))]
            if len(names) == len(set(names)) == count and all(name and not is_number(name) for name in names):
                return index, names
    return None


def _with_ends(names: list[str], cells: list[str], path: Path, row: int) -> list[str]:
    """Names the columns without a name that are harmless: row numbers in front, and delimiters at the lines' ends."""
    if len(cells) == len(names) + 1 and not cells[-1].strip():
        names = [*names, ""]
    elif len(cells) == len(names) - 1 and not names[-1]:
        names = names[:-1]
    for index, name in enumerate(names, start=1):
        if name:
            continue
        last = index == len(names) and (index > len(cells) or not cells[index - 1].strip())
        if index > 1 and not last:
            raise InputError(
                f"column number {index} has no name", file=path, row=row, remedy="name it, or leave the column out"
            )
        names = [*names[: index - 1], f"{_UNNAMED}{index})", *names[index:]]
    return names

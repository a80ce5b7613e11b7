"""CSV files, read and written by a vectorised engine; numbers keep every bit."""

from __future__ import annotations

import csv
import io
import mmap
import re
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.csv as pa_csv

from robots.common.errors import InputError
from robots.common.tables.csv_dialects import DIALECT_BYTES, Dialect, split_line
from robots.common.tables.csv_faults import NULLS, encoding_error, find_fault, is_number, named_twice
from robots.common.tables.csv_heads import is_unnamed, read_head
from robots.common.tables.ecsv import format_header
from robots.common.tables.table import Column, Table

_BYTES_AT_A_TIME = 16 * 2**20
_GAP = re.compile(rb"\n[ \t]*\r?\n")
_LONE_RETURN = re.compile(rb"\r(?!\n)")
_BLANKS = re.compile(rb"[ \t]+")
_OUTER_BLANKS = re.compile(rb"^ | (?=\r?$)", re.MULTILINE)
_LOOSE_BLANKS = re.compile(rb"[ \t]{2}|\t|^ | (?=\r?$)", re.MULTILINE)

Bytes = mmap.mmap | bytes


def csv_names(path: Path) -> list[str]:
    """Lists the column names of a CSV file without reading its data.

    Args:
        path: the file.

    Raises:
        InputError: whatever is wrong with the file's head.
    """
    with _opened(path) as data:
        # Of a long file its beginning: a return at its end may have lost its line feed.
        _check_bytes(data[:DIALECT_BYTES].rstrip(b"\r"), path)
        return [name for name in read_head(data, path).names if not is_unnamed(name)]


def read_csv(path: Path, wanted: Callable[[str], bool]) -> Table:
    """Reads a file of cells that commas, semicolons, tabs or blanks separate, with one line of names above.

    A ``#`` block may stand above the names, or hold them in its last line. A delimiter at the end of all lines, a first
    column of row numbers without a name and a first line such as ``sep=;`` are accepted.

    Args:
        path: the file, UTF-8 with or without byte order mark.
        wanted: selects by name which columns to read; those must be all numbers or all text.

    Raises:
        InputError: whatever is wrong with the file, with its column and line.
    """
    data: Bytes = _opened(path)
    _check_bytes(data, path)
    head = read_head(data, path)
    names, start, first_row, dialect = head.names, head.start, head.first_row, head.dialect
    data = _with_single_blanks(data, start, dialect)
    end = _end_of_data(data)
    if start >= end:
        raise InputError("no rows below the header", file=path, row=first_row - 1, remedy="record the data again")
    chosen = [name for name in names if not is_unnamed(name) and wanted(name)]
    for name in chosen:
        if name in head.twice:
            raise named_twice(name, path, head.row)
    first_cells = _first_cells(data, start, names, path, first_row, dialect)
    declared = {name for name in chosen if head.header.datatypes.get(name) == "string"}
    text = declared | {
        name
        for name in chosen
        if not is_number(first_cells.get(name, ""), dialect) and name not in head.header.datatypes
    }
    kinds = {name: pa.string() if name in text else pa.float64() for name in chosen}

    def fault(numeric: set[str], position: int = start) -> InputError:
        row = first_row + data[start:position].count(b"\n")
        return find_fault(_lines(data, position, end), names, numeric, path, row, dialect)

    gap = _GAP.search(data, start - 1, end)
    if gap is not None:
        raise fault(set(), max(gap.start() + 1, start))
    try:
        # Without a column to convert, the parser would convert all.
        arrays = _parse(data, start, end, names, kinds, dialect) if kinds else {}
    except (pa.ArrowException, OSError, ValueError) as error:
        raise fault(set(chosen) - text, _first_refused(data, start, end, names, kinds, dialect)) from error
    for name in sorted(text - declared, key=names.index):
        if pc.any(pc.match_substring_regex(arrays[name], r"^\s*[+-]?\.?\d[\d.]*([eE][+-]?\d+)?\s*$")).as_py():
            raise fault({name})
    return Table(
        columns={name: _to_numpy(arrays[name], name in text) for name in chosen},
        metadata=head.header.metadata,
        path=path,
        first_row=first_row,
        units={name: unit for name, unit in head.header.units.items() if name in names},
        skipped=tuple(name for name in names if name not in kinds and not is_unnamed(name)),
    )


def write_csv(
    stream: BinaryIO, columns: Mapping[str, Column], metadata: Mapping[str, Any], units: Mapping[str, str]
) -> None:
    """Writes an ECSV block, a header line and rows whose numbers are the shortest that read back exactly.

    Args:
        stream: where to write.
        columns: the columns by name, (N,) each, checked.
        metadata: for the block.
        units: for the block, by column.
    """
    names = io.StringIO()
    csv.writer(names, lineterminator="\n").writerow(columns)
    head = "\n".join([*format_header(columns, metadata, units), names.getvalue()])
    stream.write(head.encode("utf-8"))
    options = pa_csv.WriteOptions(include_header=False, quoting_style="needed")
    pa_csv.write_csv(pa.table(dict(columns)), stream, options)


def _opened(path: Path) -> mmap.mmap:
    if path.stat().st_size == 0:
        raise InputError("the file is empty", file=path, kind="empty_file")
    with path.open("rb") as stream:
        return mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ)


def _with_single_blanks(data: Bytes, start: int, dialect: Dialect) -> Bytes:
    """Makes each run of blanks one, and drops those at the ends of lines, where blanks separate the cells."""
    if dialect.delimiter != " " or _LOOSE_BLANKS.search(data, start) is None:
        return data
    body = _BLANKS.sub(b" ", data[start:])
    return data[:start] + _OUTER_BLANKS.sub(b"", body)


def _check_bytes(data: Bytes, path: Path) -> None:
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        raise InputError("the text is UTF-16", file=path, allowed="UTF-8", remedy="save the file as UTF-8")
    zero = data.find(b"\0")
    if zero >= 0:
        raise InputError(
            f"a zero byte at position {zero}",
            file=path,
            row=_line_at(data, zero),
            allowed="text in UTF-8",
            remedy="the file is binary, UTF-16, or was cut off while it was written: export it again",
        )
    lone = _LONE_RETURN.search(data) if data.find(b"\r") >= 0 else None
    if lone is not None:
        raise InputError(
            "a carriage return without a line feed",
            file=path,
            row=_line_at(data, lone.start()),
            allowed="lines that end in LF or CR LF",
            remedy="convert the line ends",
        )


def _first_cells(data: Bytes, start: int, names: list[str], path: Path, row: int, dialect: Dialect) -> dict[str, str]:
    stop = data.find(b"\n", start)
    try:
        cells = split_line(data[start : stop if stop >= 0 else len(data)].decode("utf-8").rstrip("\r\n"), dialect)
    except UnicodeDecodeError as error:
        raise encoding_error(path, row) from error
    except csv.Error as error:
        raise InputError(f"not a line of a CSV file ({error})", file=path, row=row) from error
    return dict(zip(names, cells, strict=False))


def _end_of_data(data: Bytes) -> int:
    end = len(data)
    while end > 0 and data[end - 1] in b"\r\n":
        end -= 1
    return end


def _line_at(data: Bytes, position: int) -> int:
    return data[:position].count(b"\n") + 1


def _lines(data: Bytes, start: int, end: int) -> Iterator[bytes]:
    while start < end:
        stop = data.find(b"\n", start, end)
        stop = end if stop < 0 else stop + 1
        yield data[start:stop]
        start = stop


def _first_refused(
    data: Bytes, start: int, end: int, names: list[str], kinds: dict[str, pa.DataType], dialect: Dialect
) -> int:
    """Returns where the first refused block starts: to look at each line of a long file would take minutes."""
    while start < end:
        stop = data.find(b"\n", min(start + _BYTES_AT_A_TIME, end), end)
        stop = end if stop < 0 else stop + 1
        try:
            _parse(data, start, stop, names, kinds, dialect)
        except (pa.ArrowException, OSError, ValueError):
            break
        start = stop
    return start


def _parse(
    data: Bytes, start: int, end: int, names: list[str], kinds: dict[str, pa.DataType], dialect: Dialect
) -> dict[str, pa.ChunkedArray]:
    # The parser reads the mapped file: a slice of bytes would copy it.
    table = pa_csv.read_csv(
        pa.BufferReader(pa.py_buffer(data).slice(start, end - start)),
        read_options=pa_csv.ReadOptions(column_names=names, block_size=_BYTES_AT_A_TIME),
        parse_options=pa_csv.ParseOptions(delimiter=dialect.delimiter, ignore_empty_lines=False),
        convert_options=pa_csv.ConvertOptions(
            column_types=kinds,
            include_columns=list(kinds),
            null_values=list(NULLS),
            strings_can_be_null=False,
            decimal_point=dialect.decimal,
        ),
    )
    return {name: table.column(name) for name in kinds}


def _to_numpy(array: pa.ChunkedArray, text: bool) -> Column:
    values: Column = array.to_numpy()
    return values.astype(object) if text else values.astype(np.float64, copy=False)

"""Tables in files: one reader and one writer for CSV and Parquet, chosen by the suffix."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from os import PathLike
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq
from numpy.typing import ArrayLike

from robots.common.errors import InputError
from robots.common.files import existing_file, open_atomic
from robots.common.tables.csv_faults import check_unique, is_number
from robots.common.tables.csv_tables import read_csv, write_csv
from robots.common.tables.ecsv import plain
from robots.common.tables.table import Column, Table
from robots.common.tables.times import seconds_since_1970

__all__ = ["Table", "read_table", "write_table"]

SUFFIXES = (".csv", ".parquet")
_KEY = b"table"
_FOREIGN = ("pandas", "ARROW:schema", "table")


def read_table(path: str | PathLike[str], *, wanted: Callable[[str], bool] | None = None) -> Table:
    """Reads a table from ``.csv`` (commas, semicolons, tabs or blanks, a leading ``#`` block allowed) or ``.parquet``.

    Args:
        path: the file.
        wanted: selects by name which columns to read, all by default; the others are named in ``Table.skipped`` and may
            hold anything.

    Returns:
        The table; a column is float64 if all its cells are numbers or empty, and object if none is a number.

    Raises:
        InputError: a missing, empty or unreadable file, no header, a duplicate column, a row of another length, a cell
            that is no number in a column of numbers; with column and line where they apply.
    """
    path = existing_file(path)
    suffix = _suffix(path)
    wanted = wanted or (lambda name: True)
    return read_csv(path, wanted) if suffix == ".csv" else read_parquet(path, wanted)


def write_table(
    path: str | PathLike[str],
    columns: Mapping[str, ArrayLike],
    metadata: Mapping[str, Any] | None = None,
    *,
    units: Mapping[str, str] | None = None,
    force: bool = False,
) -> None:
    """Writes a table that reads back exactly, as ``.csv`` with an ECSV block or as ``.parquet``; whole or not at all.

    Args:
        path: the file.
        columns: the columns by name, (N,) each: numbers or text.
        metadata: anything of text, numbers, lists and mappings.
        units: the unit of a column by its name.
        force: whether an existing file may be replaced.

    Raises:
        InputError: another suffix, columns that make no table, an existing file without ``force``, or a folder that
            cannot be written to.
    """
    path = Path(path)
    suffix = _suffix(path)
    arrays = _checked_columns(columns, path)
    units = dict(units or {})
    for name in units:
        if name not in arrays:
            raise InputError("a unit for a column that does not exist", file=path, column=name)
    write = write_csv if suffix == ".csv" else _write_parquet
    with open_atomic(path, force=force) as stream:
        try:
            write(stream, arrays, dict(metadata or {}), units)
        except (pa.ArrowException, UnicodeError, OSError) as error:
            raise InputError(f"cannot be written ({error})", file=path) from error


def _suffix(path: Path) -> str:
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise InputError(
            f"a file of type {path.suffix or '(none)'!r}",
            file=path,
            allowed=" or ".join(SUFFIXES),
            remedy="rename it",
            kind="unknown_file_type",
        )
    return suffix


def _checked_columns(columns: Mapping[str, ArrayLike], path: Path) -> dict[str, Column]:
    if not columns:
        raise InputError("no columns to write", file=path)
    arrays: dict[str, Column] = {}
    first = next(iter(columns))
    for name, values in columns.items():
        # Text that the reader would interpret differently must not be written.
        if not name or name != name.strip() or set(name) & set(',;"#\r\n\t\0'):
            raise InputError(f"{name!r} cannot name a column", file=path, allowed='text without , ; " # or line ends')
        array = np.asarray(values)
        if array.ndim != 1 or len(array) == 0:
            raise InputError(f"shape {array.shape}", file=path, column=name, allowed="shape (N,), N at least 1")
        arrays[name] = _writable(array, path, name)
        if len(array) != len(arrays[first]):
            raise InputError(f"{len(array)} rows, but column {first} has {len(arrays[first])}", file=path, column=name)
    if len(arrays) == 1 and " " in first:
        raise InputError(f"{first!r} cannot name the only column", file=path, allowed="a name without spaces")
    if all(is_number(name) for name in arrays):
        raise InputError("column names that are all numbers", file=path, allowed="at least one that is a word")
    return arrays


def _writable(array: Column, path: Path, name: str) -> Column:
    if array.dtype.kind == "f":
        return np.ascontiguousarray(array, dtype=np.float64)
    if array.dtype.kind in "iub":
        return np.ascontiguousarray(array, dtype=np.int64)
    texts = array.astype(object)
    for row, cell in enumerate(texts, start=1):
        if not isinstance(cell, str) or set(cell) & set("\r\n\0"):
            raise InputError(
                f"found {cell!r}", file=path, column=name, row=row, allowed="numbers, or text of one line in all rows"
            )
    return texts


def parquet_names(path: Path) -> list[str]:
    """Lists the column names of a Parquet file without reading its data.

    Args:
        path: the file.

    Raises:
        InputError: no Parquet file.
    """
    try:
        with pq.ParquetFile(path) as file:
            return list(_layout(file))
    except (pa.ArrowException, OSError, ValueError) as error:
        raise _no_parquet(path, error) from error


def read_parquet(path: Path, wanted: Callable[[str], bool]) -> Table:
    """Reads columns of a Parquet file; a stamp of time becomes seconds, a list of k numbers ``name1`` to ``namek``.

    Args:
        path: the file.
        wanted: selects by name which columns to read.

    Raises:
        InputError: no Parquet file, a column twice, or a column that holds neither numbers nor text.
    """
    if path.stat().st_size == 0:
        raise InputError("the file is empty", file=path, kind="empty_file")
    try:
        with pq.ParquetFile(path, memory_map=True) as file:
            schema = file.schema_arrow
            check_unique(schema.names, path)
            layout = {
                f"{name}1" if place == 0 and name == stored and not wanted(name) and wanted(f"{name}1") else name: (
                    stored,
                    place,
                )
                for name, (stored, place) in _layout(file).items()
            }
            check_unique(layout, path)
            chosen = [name for name in layout if wanted(name)]
            content = file.read(columns=list(dict.fromkeys(layout[name][0] for name in chosen)))
        arrays = {}
        for name in chosen:
            stored_as, place = layout[name]
            column = content.column(stored_as)
            arrays[name] = parquet_column(column if place is None else _of_lists(column, place, name, path), name, path)
    except (pa.ArrowException, OSError, ValueError, KeyError) as error:
        raise _no_parquet(path, error) from error
    if content.num_rows == 0:
        raise InputError("no rows", file=path, remedy="record the data again")
    stored, units = stored_in(schema.metadata or {})
    return Table(
        columns=arrays,
        metadata=stored,
        path=path,
        first_row=1,
        units=units,
        skipped=tuple(name for name in layout if name not in arrays),
    )


def _layout(file: pq.ParquetFile) -> dict[str, tuple[str, int | None]]:
    """Names the columns with lists split: the stored column of each, and its place in the list of a row.

    How long the lists of a column are is said by its type, or by its first row.
    """
    schema = file.schema_arrow
    lists = [field.name for field in schema if _is_list(field.type)]
    first = next(iter(file.iter_batches(1, columns=lists)), None) if lists else None
    layout: dict[str, tuple[str, int | None]] = {}
    for name in schema.names:
        values = first.column(name)[0].as_py() if first is not None and name in lists else None
        if values is None:
            layout[name] = (name, None)
        else:
            # A list of one number is a number.
            named = [name] if len(values) == 1 else [f"{name}{k}" for k in range(1, len(values) + 1)]
            layout.update({column: (name, place) for place, column in enumerate(named)})
    return layout


def _is_list(kind: pa.DataType) -> bool:
    is_list = pa.types.is_list(kind) or pa.types.is_large_list(kind) or pa.types.is_fixed_size_list(kind)
    return is_list and (pa.types.is_floating(kind.value_type) or pa.types.is_integer(kind.value_type))


def _of_lists(column: pa.ChunkedArray, place: int, name: str, path: Path) -> pa.ChunkedArray:
    """Gives one number of each row's list."""
    lengths = pc.unique(pc.list_value_length(column)).drop_null().to_pylist()
    if len(lengths) > 1:
        raise InputError(
            f"lists of {min(lengths)} to {max(lengths)} numbers", file=path, column=name, allowed="one length"
        )
    return pc.list_element(column, place)


def _no_parquet(path: Path, error: Exception) -> InputError:
    return InputError(
        f"not a Parquet file that can be read ({str(error).splitlines()[0] if str(error) else 'damaged'})",
        file=path,
        remedy="write it again",
    )


def stored_in(metadata: Mapping[bytes, bytes]) -> tuple[dict[str, Any], dict[str, str]]:
    """Returns metadata and units of a Parquet schema; of a file written by others, its plain key-value pairs."""
    if _KEY in metadata:
        try:
            content = json.loads(metadata[_KEY])
            return dict(content["meta"]), dict(content["units"])
        except (ValueError, KeyError, TypeError):
            pass
    foreign = {key.decode(errors="replace"): value.decode(errors="replace") for key, value in metadata.items()}
    return {key: value for key, value in foreign.items() if key not in _FOREIGN}, {}


def parquet_column(column: pa.ChunkedArray, name: str, path: Path) -> Column:
    """Gives the values of a column: numbers (N,) with NaN for missing ones, seconds for moments, or text.

    Raises:
        InputError: a column of another type.
    """
    kind = column.type
    if pa.types.is_dictionary(kind):
        column = column.cast(kind.value_type)
        kind = column.type
    if pa.types.is_boolean(kind):
        column = column.cast(pa.int8())
    elif pa.types.is_string(kind) or pa.types.is_large_string(kind):
        texts: Column = column.fill_null("").to_numpy().astype(object)
        return texts
    elif pa.types.is_timestamp(kind):
        return seconds_since_1970(column.to_numpy())
    elif not (pa.types.is_integer(kind) or pa.types.is_floating(kind) or pa.types.is_null(kind)):
        raise InputError(
            f"a column of type {kind}", file=path, column=name, allowed="numbers (time in seconds) or text"
        )
    if kind != pa.float64():
        column = column.cast(pa.float64(), safe=False)
    # One chunk without nulls comes out as a view of Arrow's memory.
    values: Column = column.chunk(0).to_numpy(zero_copy_only=False) if column.num_chunks == 1 else column.to_numpy()
    return values


def _write_parquet(
    stream: BinaryIO, columns: Mapping[str, Column], metadata: Mapping[str, Any], units: Mapping[str, str]
) -> None:
    stored = json.dumps({"meta": plain(metadata), "units": dict(units)}).encode()
    pq.write_table(pa.table(dict(columns)).replace_schema_metadata({_KEY: stored}), stream)

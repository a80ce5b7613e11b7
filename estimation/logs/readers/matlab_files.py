"""MATLAB files, version 5 by scipy and 7.3 by h5py, as tables."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robots.common.errors import InputError
from robots.common.tables.table import Column, Table

# Version 7.3 is HDF5 behind a block of 512 bytes.
_HDF5 = b"\x89HDF\r\n\x1a\n"


def read_matlab(path: Path, wanted: Callable[[str], bool]) -> Table:
    """Reads the numeric variables of a MAT file as columns.

    A vector is a column of its own name; a matrix of N rows (or N columns) and k joints is the columns ``name1`` to
    ``namek``; the fields of a structure are ``name.field``. N is the length of the time ``t`` or, without one, the
    longest dimension.

    Args:
        path: the file.
        wanted: selects by name which columns to keep.

    Raises:
        InputError: no MAT file, or nothing numeric in it.
    """
    with path.open("rb") as stream:
        head = stream.read(520)
    if not head:
        raise InputError("the file is empty", file=path, kind="empty_file")
    variables = _read_new(path) if _HDF5 in head else _read_old(path)
    return columns_of(variables, path, wanted)


def columns_of(variables: Mapping[str, NDArray[Any]], path: Path, wanted: Callable[[str], bool]) -> Table:
    """Makes a table of numeric arrays: vectors become columns, matrices as many as they are wide.

    Args:
        variables: the arrays by name.
        path: where they are from.
        wanted: selects by name which columns to keep.

    Raises:
        InputError: no array, or none as long as the others.
    """
    arrays = {name: np.atleast_1d(np.squeeze(array)) for name, array in variables.items()}
    arrays = {name: array for name, array in arrays.items() if array.dtype.kind in "biuf" and array.ndim <= 2}
    if not arrays:
        raise InputError("no numeric arrays", file=path, allowed="t, q and tau or i, or those that a mapping names")
    rows = max(max(array.shape) for array in arrays.values())
    if "t" in arrays and arrays["t"].ndim == 1:
        rows = len(arrays["t"])
    columns: dict[str, Column] = {}
    skipped: list[str] = []
    for name, array in arrays.items():
        if array.ndim == 2 and array.shape[0] != rows and array.shape[1] == rows:
            array = array.T
        if array.shape[0] != rows:
            if wanted(name) or wanted(f"{name}1"):
                raise InputError(
                    f"shape {array.shape}", file=path, column=name, allowed=f"{rows} rows, as the time has"
                )
            skipped.append(name)
            continue
        parts = {name: array} if array.ndim == 1 else {f"{name}{k + 1}": array[:, k] for k in range(array.shape[1])}
        if array.ndim == 1 and not wanted(name) and wanted(f"{name}1"):
            parts = {f"{name}1": array}
        for column, values in parts.items():
            if column in columns:
                raise InputError("the column appears twice", file=path, column=column)
            if wanted(column):
                columns[column] = np.ascontiguousarray(values, dtype=np.float64)
            else:
                skipped.append(column)
    return Table(columns=columns, metadata={}, path=path, first_row=1, skipped=tuple(skipped))


def _read_old(path: Path) -> dict[str, NDArray[Any]]:
    from scipy.io import loadmat

    try:
        content = loadmat(path, struct_as_record=False, squeeze_me=True)
        return dict(_flattened({name: value for name, value in content.items() if not name.startswith("__")}))
    # A damaged file fails anywhere in scipy's reader, which raises whatever comes up.
    except Exception as error:
        raise _unreadable(path, error) from error


def _flattened(content: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, NDArray[Any]]]:
    for name, value in content.items():
        fields = getattr(value, "_fieldnames", None)
        if fields is not None:
            yield from _flattened({field: getattr(value, field) for field in fields}, f"{prefix}{name}.")
        elif isinstance(value, np.ndarray | np.generic | int | float):
            yield f"{prefix}{name}", np.asarray(value)


def _read_new(path: Path) -> dict[str, NDArray[Any]]:
    try:
        import h5py
    except ImportError as error:
        raise InputError(
            "a MAT file of version 7.3", file=path, remedy="install h5py (pip install 'robot-oed[mat]')"
        ) from error
    found: dict[str, NDArray[Any]] = {}

    def collect(name: str, item: Any) -> None:
        # References (#refs#) belong to cells and tables, which hold no plain columns.
        if isinstance(item, h5py.Dataset) and not name.startswith("#") and item.dtype.kind in "biuf":
            found[name.replace("/", ".")] = np.asarray(item[()]).T

    try:
        with h5py.File(path, "r") as file:
            file.visititems(collect)
    except Exception as error:
        raise _unreadable(path, error) from error
    return found


def _unreadable(path: Path, error: Exception) -> InputError:
    text = str(error).splitlines()
    return InputError(
        f"the MAT file cannot be read ({text[0] if text else type(error).__name__})",
        file=path,
        remedy="save numeric arrays or a structure of arrays; MATLAB tables and time series are not supported",
    )

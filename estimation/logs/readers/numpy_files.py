"""Archives of numpy (.npz) as tables."""

from __future__ import annotations

import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path

import numpy as np

from estimation.logs.readers.matlab_files import columns_of
from robots.common.errors import InputError
from robots.common.tables.table import Table

# What numpy and zipfile raise on damaged archives.
_DAMAGED = (
    OSError,
    ValueError,
    EOFError,
    KeyError,
    MemoryError,
    OverflowError,
    NotImplementedError,
    SyntaxError,
    RuntimeError,
    zipfile.BadZipFile,
    zlib.error,
)


def read_npz(path: Path, wanted: Callable[[str], bool]) -> Table:
    """Reads the arrays of an archive: vectors as columns, matrices (N, k) as ``name1`` to ``namek``.

    Args:
        path: the file.
        wanted: selects by name which columns to keep.

    Raises:
        InputError: no archive of arrays, or one that holds objects.
    """
    if path.stat().st_size == 0:
        raise InputError("the file is empty", file=path)
    try:
        with path.open("rb") as stream:
            archive = np.load(stream, allow_pickle=False)
            if not isinstance(archive, np.lib.npyio.NpzFile):
                raise ValueError("a single array")
            variables = {name: archive[name] for name in archive.files}
    except _DAMAGED as error:
        text = str(error).splitlines()
        raise InputError(
            f"the .npz archive cannot be read ({text[0] if text else type(error).__name__})",
            file=path,
            remedy="write it with numpy.savez(path, t=..., q=..., tau=...)",
        ) from error
    return columns_of(variables, path, wanted)

"""PyTorch files (.pt) as tables, without PyTorch: a zip of a pickle and raw tensors."""

from __future__ import annotations

import io
import pickle
import zipfile
from collections import OrderedDict
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from estimation.logs.readers.matlab_files import columns_of
from robots.common.errors import InputError
from robots.common.tables.table import Table

SUFFIX = ".pt"
NAMES = {"time": "t", "dof_pos": "q", "des_dof_pos": "qref", "dof_vel": "dq", "dof_torque": "tau"}
"""Keys of the recordings of PACE and its relatives, as the columns of a log."""
_KINDS = {
    "DoubleStorage": "f8",
    "FloatStorage": "f4",
    "HalfStorage": "f2",
    "LongStorage": "i8",
    "IntStorage": "i4",
    "ShortStorage": "i2",
    "CharStorage": "i1",
    "ByteStorage": "u1",
    "BoolStorage": "?",
}


class _Unpickler(pickle.Unpickler):
    """Reads tensors, dictionaries and plain values, and runs nothing."""

    def __init__(self, stream: io.BytesIO, archive: zipfile.ZipFile, root: str) -> None:
        super().__init__(stream)
        self._archive, self._root = archive, root

    def find_class(self, module: str, name: str) -> Any:
        """Gives the few functions that a file of tensors names."""
        if (module, name) in (("torch._utils", "_rebuild_tensor_v2"), ("torch._utils", "_rebuild_tensor")):
            return _tensor
        if module == "torch" and name in _KINDS:
            return name
        if (module, name) == ("collections", "OrderedDict"):
            return OrderedDict
        raise pickle.UnpicklingError(f"it holds {module}.{name}, which is no tensor")

    def persistent_load(self, pid: Any) -> Any:
        """Reads the raw numbers of a storage."""
        _, kind, key, *_ = pid
        return np.frombuffer(self._archive.read(f"{self._root}/data/{key}"), dtype=f"<{_KINDS[kind]}")


def _tensor(storage: Any, offset: int, size: tuple[int, ...], stride: tuple[int, ...], *_: Any) -> Any:
    count = 1 + sum((n - 1) * step for n, step in zip(size, stride, strict=True)) if all(size) else 0
    part = storage[offset : offset + count]
    if len(part) < count:
        raise pickle.UnpicklingError("a tensor that is longer than its numbers")
    return np.lib.stride_tricks.as_strided(part, size, tuple(step * part.itemsize for step in stride)).astype(float)


def read_torch(path: Path, wanted: Callable[[str], bool]) -> Table:
    """Reads a dictionary of tensors: vectors as columns, matrices (N, k) as ``name1`` to ``namek``.

    The keys ``time``, ``dof_pos`` and ``des_dof_pos`` of PACE are a log's ``t``, ``q`` and ``qref``.

    Args:
        path: the file.
        wanted: selects by name which columns to keep.

    Raises:
        InputError: another file, or one that holds more than tensors.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            inner = next(name for name in archive.namelist() if name.endswith("data.pkl"))
            root = inner.removesuffix("/data.pkl")
            data = _Unpickler(io.BytesIO(archive.read(inner)), archive, root).load()
    # A damaged pickle raises whatever comes up.
    except Exception as error:
        text = str(error).splitlines()
        raise InputError(
            f"the .pt file cannot be read ({text[0] if text else type(error).__name__})",
            file=path,
            allowed="a dictionary of tensors, written by torch.save",
        ) from error
    if not isinstance(data, dict):
        raise InputError(f"the .pt file holds a {type(data).__name__}", file=path, allowed="a dictionary of tensors")
    arrays = {NAMES.get(str(key), str(key)): value for key, value in data.items() if isinstance(value, np.ndarray)}
    return columns_of(arrays, path, wanted)

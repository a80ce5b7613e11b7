"""A log that is written row by row: after a kill it is whole up to its last rows."""

from __future__ import annotations

import errno
import os
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from oed.controllers.errors import RecordingError
from robots.common.errors import InputError
from robots.common.files import open_atomic
from robots.common.locks import close_locked, lock
from robots.common.tables.ecsv import format_header

WRITING_PERIOD = 0.2
"""Rows are written after so long at the latest [s]."""

FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
"""A disk, a quota or a file that has no room left."""


class FeedbackLog:
    """Appends rows to a CSV file below an ECSV block.

    Rows reach the system in whole lines, so a killed program leaves a log that can be read. Where the disk is full,
    the last whole line stays the last.

    Attributes:
        path: the file.
        rows: those that were appended, without those that a full disk did not take.

    Args:
        path: the file, ending in .csv.
        columns: names.
        units: by column.
        metadata: for the block.
        digits: significant digits of every number but the time.
        force: whether an existing file may be replaced.

    Raises:
        InputError: another suffix, an existing file without force, or a folder that cannot be written to.
    """

    def __init__(
        self,
        path: str | PathLike[str],
        columns: Sequence[str],
        units: Mapping[str, str],
        metadata: Mapping[str, Any],
        *,
        digits: int = 17,
        force: bool = False,
    ) -> None:
        self.path = check_log_path(path, force)
        self.rows = 0
        self._columns, self._units, self._metadata = list(columns), dict(units), dict(metadata)
        self._number = f"%.{digits}g"
        self._held: list[str] = []
        self._written = time.monotonic()
        try:
            self._file: int | None = os.open(self.path, os.O_WRONLY | os.O_CREAT | (0 if force else os.O_EXCL), 0o644)
        except OSError as error:
            raise InputError(
                f"cannot be written ({(error.strerror or str(error)).lower()})",
                file=self.path,
                remedy="choose another folder",
            ) from error
        self._size = 0
        self._claim()
        try:
            self._put(self._header(self._metadata))
        except RecordingError:
            self.discard()
            raise
        self._head = self._size

    def append(self, t: float, values: Sequence[float]) -> None:
        """Adds a row; it is written within `WRITING_PERIOD` while rows come.

        Args:
            t: time [s].
            values: of the other columns.

        Raises:
            RecordingError: the disk is full.
        """
        self._held.append(f"{t!r},{','.join([self._number % value for value in values])}\n")
        self.rows += 1
        if time.monotonic() - self._written > WRITING_PERIOD:
            self.flush()

    def flush(self) -> None:
        """Writes what is held.

        Raises:
            RecordingError: the disk is full.
        """
        data = "".join(self._held).encode()
        self._held.clear()
        self._written = time.monotonic()
        if data:
            self._put(data)

    def close(self) -> None:
        """Writes what is held and closes the file.

        Raises:
            RecordingError: the disk is full; the rows that were recorded stay.
        """
        if self._file is None:
            return
        try:
            self.flush()
        finally:
            self._shut()

    def complete(self, metadata: Mapping[str, Any]) -> None:
        """Replaces the closed file by one that states more in its block; where that fails, it stays as it is.

        Args:
            metadata: what is known at the end.

        Raises:
            InputError: the disk has no room for both.
        """
        with open_atomic(self.path, force=True) as target, self.path.open("rb") as source:
            try:
                target.write(self._header({**self._metadata, **metadata}))
                source.seek(self._head)
                while block := source.read(2**20):
                    target.write(block)
            except OSError as error:
                raise self._stopped(error) from error

    def discard(self) -> None:
        """Removes a file without rows."""
        self._shut()
        with suppress(OSError):
            self.path.unlink()

    def _shut(self) -> None:
        if self._file is not None:
            close_locked(self._file)
            self._file = None

    def _claim(self) -> None:
        """Empties the file, unless another program is recording into it: its lock ends with it, also by a kill."""
        assert self._file is not None
        try:
            # Nobody could read a file that is locked on Windows.
            if os.name != "nt":
                lock(self._file)
        except BlockingIOError as error:
            self._shut()
            raise InputError(
                "another program is recording into this file", file=self.path, remedy="choose another name"
            ) from error
        except OSError:
            pass  # Some network drives have no locks.
        with suppress(OSError):  # A device cannot be emptied.
            os.ftruncate(self._file, 0)

    def _header(self, metadata: Mapping[str, Any]) -> bytes:
        kinds = {name: np.zeros(0) for name in self._columns}
        return "\n".join([*format_header(kinds, metadata, self._units), ",".join(self._columns), ""]).encode()

    def _put(self, data: bytes) -> None:
        assert self._file is not None
        view = memoryview(data)
        try:
            while view:
                view = view[os.write(self._file, view) :]
        except OSError as error:
            whole = data.rfind(b"\n", 0, len(data) - len(view)) + 1
            self.rows -= data.count(b"\n", whole)
            with suppress(OSError):
                os.ftruncate(self._file, self._size + whole)
            raise self._stopped(error) from error
        self._size += len(data)

    def _stopped(self, error: OSError) -> RecordingError:
        return RecordingError(
            f"recording stopped ({(error.strerror or str(error)).lower()})",
            file=self.path,
            remedy="make room on the disk" if error.errno in FULL else "check the disk",
        )


def check_log_path(path: str | PathLike[str], force: bool) -> Path:
    """Refuses a log file that cannot be written, before anything moves.

    Raises:
        InputError: another suffix, a folder, an existing file without force, or no such folder.
    """
    path = Path(path)
    if path.suffix.lower() != ".csv":
        raise InputError(f"a log of type {path.suffix or '(none)'!r}", file=path, allowed=".csv", remedy="rename it")
    if path.is_dir():
        raise InputError("this is a folder, but a file should be written here", file=path)
    if os.path.lexists(path) and not force:
        raise InputError("the file exists", file=path, remedy="use force (--force) to overwrite, or another name")
    if not path.parent.is_dir():
        raise InputError(f"there is no folder {path.parent} to write to", file=path, remedy="create the folder first")
    return path

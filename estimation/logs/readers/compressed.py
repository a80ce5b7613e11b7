"""Compressed files: one log in a gzip, bzip2, xz or zip file is unpacked for reading."""

from __future__ import annotations

import bz2
import gzip
import lzma
import shutil
import tempfile
import zipfile
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from os import PathLike
from pathlib import Path
from typing import Any

from robots.common.errors import InputError
from robots.common.files import existing_file

_ZIP = b"PK\x03\x04"
_STREAMS: dict[bytes, Callable[..., Any]] = {b"\x1f\x8b": gzip.open, b"BZh": bz2.open, b"\xfd7zXZ\0": lzma.open}
SUFFIXES = (".gz", ".bz2", ".xz")
"""Endings of compressed files; the name in front of them is that of the file inside."""

# What the modules raise on damaged or encrypted files.
_DAMAGED = (OSError, EOFError, RuntimeError, NotImplementedError, zipfile.BadZipFile, zlib.error, lzma.LZMAError)


@contextmanager
def unpacked(path: str | PathLike[str], is_log: Callable[[Path], bool]) -> Iterator[Path]:
    """Gives a file as it is, or what is in it while the block runs; errors name the file itself.

    Args:
        path: a log, or the folder of a rosbag 2.
        is_log: says by its name whether a file or folder in a zip file may be a log.

    Raises:
        InputError: a missing or damaged file, or a zip file without a log, or with several.
    """
    place = Path(path)
    head = b"" if place.is_dir() else _head(existing_file(place))
    opener = next((opener for mark, opener in _STREAMS.items() if head.startswith(mark)), None)
    if opener is None and not (head.startswith(_ZIP) and not _is_log_itself(place)):
        yield place
        return
    # Arrays may still be views of an unpacked file, which some systems do not delete then.
    with tempfile.TemporaryDirectory(prefix="oed-", ignore_cleanup_errors=True) as folder:
        try:
            if opener is None:
                inside = _from_zip(place, Path(folder), is_log)
            else:
                inside = Path(folder) / (place.stem if place.suffix.lower() in SUFFIXES else place.name)
                with opener(place, "rb") as source, inside.open("wb") as target:
                    shutil.copyfileobj(source, target, 2**20)
        except _DAMAGED as error:
            raise InputError(
                f"the compressed file cannot be read ({error or type(error).__name__})",
                file=place,
                remedy="unpack it, or compress the log again without a password",
            ) from error
        try:
            yield inside
        except InputError as error:
            if error.file is not None and Path(error.file) == inside:
                error.file = str(path)
            raise


def _head(path: Path) -> bytes:
    with path.open("rb") as stream:
        return stream.read(8)


def _is_log_itself(path: Path) -> bool:
    """Whether a zip file is an archive of numpy or PyTorch; a damaged one of that name is its reader's business."""
    if path.suffix.lower() in (".npz", ".pt"):
        return True
    try:
        with zipfile.ZipFile(path) as archive:
            return all(name.endswith(".npy") for name in archive.namelist())
    except _DAMAGED:
        return False


def _from_zip(path: Path, folder: Path, is_log: Callable[[Path], bool]) -> Path:
    """Unpacks a zip file and gives the only log in it."""
    with zipfile.ZipFile(path) as archive:
        if "[Content_Types].xml" in archive.namelist():
            raise InputError(
                "a workbook of a spreadsheet", file=path, allowed="a table as text", remedy="save the sheet as CSV"
            )
        archive.extractall(folder)
    places = [place for place in sorted(folder.rglob("*")) if "__MACOSX" not in place.parts and is_log(place)]
    # The files of a bag are part of it.
    logs = [place for place in places if not any(other in place.parents for other in places)]
    if len(logs) != 1:
        names = ", ".join(str(place.relative_to(folder)) for place in logs[:10])
        raise InputError(
            f"{len(logs)} logs in the zip file" + (f": {names}" if names else ""),
            file=path,
            allowed="one log",
            remedy="unpack it and give the folder, or one of its files",
        )
    return logs[0]

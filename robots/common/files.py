"""Files that are written whole or not at all, and checked before they are read."""

from __future__ import annotations

import hashlib
import os
import secrets
import shutil
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from os import PathLike
from pathlib import Path, PurePath
from types import TracebackType
from typing import BinaryIO

from robots.common.errors import InputError

PARTIAL = ".partial"
"""How the names of files end that are not whole yet; they begin with a dot."""

_OVERWRITE = "use force (--force) to overwrite, or choose another name"


def existing_file(path: str | PathLike[str]) -> Path:
    """Returns the path of a regular file that can be read.

    Args:
        path: where the file should be.

    Returns:
        The same path.

    Raises:
        InputError: nothing there, a folder, not a regular file, or no permission to read it.
    """
    path = Path(path)
    try:
        if path.is_dir():
            raise InputError("a folder, not a file", file=path, allowed="a file")
        if not path.exists():
            raise InputError("no such file", file=path, remedy="check the path", kind="no_such_file")
        if not path.is_file():
            raise InputError("a device or pipe, not a regular file", file=path, remedy="save the data to a file first")
        with path.open("rb"):
            pass
    except (OSError, ValueError) as error:
        raise InputError(f"cannot be read ({_reason(error)})", file=path) from error
    return path


def sha256(path: str | PathLike[str]) -> str:
    """Returns the SHA-256 digest of a file's bytes as 64 hexadecimal digits.

    Args:
        path: the file.

    Raises:
        InputError: the file is missing or cannot be read.
    """
    with existing_file(path).open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def write_atomic(path: str | PathLike[str], data: str | bytes, *, force: bool = False) -> None:
    """Writes a file that is either complete or not there.

    Args:
        path: the file; its folder must exist.
        data: its content; text is written as UTF-8 with the line ends it has.
        force: whether an existing file may be replaced.

    Raises:
        InputError: the file exists and ``force`` is not set, or it cannot be written.
    """
    content = data.encode("utf-8") if isinstance(data, str) else data
    with open_atomic(path, force=force) as stream, _as_input_error(Path(path)):
        stream.write(content)


@contextmanager
def open_atomic(path: str | PathLike[str], *, force: bool = False) -> Iterator[BinaryIO]:
    """Opens a binary stream whose bytes appear under ``path`` on a clean exit only.

    Args:
        path: the file; its folder must exist.
        force: whether an existing file may be replaced.

    Yields:
        A stream open for writing.

    Raises:
        InputError: the file exists and ``force`` is not set, or it cannot be written.
    """
    path = Path(path)
    _check_target(path, force)
    # A link keeps pointing where it does: its target is replaced, not the link.
    target = Path(os.path.realpath(path))
    if not target.parent.is_dir():
        raise InputError(f"there is no folder {path.parent} to write to", file=path, remedy="create the folder first")
    partial = target.with_name(f".{target.name[:100]}.{secrets.token_hex(4)}{PARTIAL}")
    try:
        with _as_input_error(path):
            stream = partial.open("xb")
        with stream:
            yield stream
            with _as_input_error(path):
                stream.flush()
                os.fsync(stream.fileno())
        _check_target(path, force)
        with _as_input_error(path):
            os.replace(partial, target)
    finally:
        with suppress(OSError):
            partial.unlink()


def remove_partial_files(folder: str | PathLike[str]) -> None:
    """Removes what killed programs left unfinished in a folder and below.

    Args:
        folder: one to which no other program writes now.
    """
    for path in Path(folder).rglob(f".*{PARTIAL}"):
        if path.is_file() and not path.is_symlink():
            with suppress(OSError):
                path.unlink()


class ResultFolder:
    """A folder of results that receives all files of a run together, or none.

    Files are written in a hidden folder and moved on a clean exit. On any exception, and on an interrupt even
    while files are being moved, the folder is left as it was. Its other files stay untouched. A new folder appears with
    all its files at once, so a killed program leaves it whole or not at all.

    Example:
        ``with ResultFolder(folder, names=("model.json",)) as out: write(out.path("model.json"))``

    Args:
        folder: where the results go; it and its parents are created if need be.
        force: whether existing files of the same names may be replaced.
        names: the files that will be written, as far as known: an existing one is refused before work begins.
    """

    def __init__(self, folder: str | PathLike[str], force: bool = False, *, names: Sequence[str] = ()) -> None:
        self.folder = Path(folder)
        self.force = force
        self.names = tuple(names)
        self._staging: Path | None = None
        self._created: list[Path] = []

    def __enter__(self) -> ResultFolder:
        for ancestor in (self.folder, *self.folder.parents):
            if os.path.lexists(ancestor) and not ancestor.is_dir():
                raise InputError("this is a file, but a folder is needed", file=ancestor, allowed="a folder")
        for name in self.names:
            _check_target(self.folder / self._relative(name), self.force)
        token = secrets.token_hex(4)
        # Inside an existing folder the moves stay on one file system even where the folder is a mount point.
        base = self.folder if self.folder.is_dir() else self.folder.parent
        try:
            self._make(base)
            staging = base / f".{self.folder.name[:100]}.{token}{PARTIAL}"
            # Noted first, so that an interrupt right after the call leaves nothing either.
            self._staging = staging
            with _as_input_error(self.folder):
                staging.mkdir()
        except BaseException:
            self._discard(keep_created=False)
            raise
        return self

    def path(self, name: str) -> Path:
        """Returns where to write a file of that name for now.

        Args:
            name: the file's name in the folder; it may hold sub-folders.

        Raises:
            InputError: the name is absolute or leads out of the folder.
            RuntimeError: the folder was not entered with ``with``.
        """
        if self._staging is None:
            raise RuntimeError("ResultFolder.path() needs an open folder: use `with ResultFolder(...) as out:`")
        path = self._staging / "new" / self._relative(name)
        with _as_input_error(self.folder):
            path.parent.mkdir(parents=True, exist_ok=True)
        return path

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        committed = False
        try:
            if kind is None:
                self._commit()
                committed = True
        finally:
            self._discard(keep_created=committed)

    def _commit(self) -> None:
        assert self._staging is not None
        new, old = self._staging / "new", self._staging / "old"
        files = sorted(path.relative_to(new) for path in new.rglob("*") if not path.is_dir())
        for name in files:
            _check_target(self.folder / name, self.force)
        if files and not os.path.lexists(self.folder):
            with _as_input_error(self.folder):
                self._make(self.folder.parent)
                os.replace(new, self.folder)
            return
        undo: list[tuple[Path, Path]] = []
        try:
            with _as_input_error(self.folder):
                self._make(self.folder)
                for name in files:
                    target, backup = self.folder / name, old / name
                    self._make(target.parent)
                    if os.path.lexists(target):
                        backup.parent.mkdir(parents=True, exist_ok=True)
                        undo.append((backup, target))
                        os.replace(target, backup)
                    undo.append((target, new / name))
                    os.replace(new / name, target)
        except BaseException:
            # An entry is noted before its move, so the last one may not have happened.
            for source, destination in reversed(undo):
                with suppress(FileNotFoundError):
                    os.replace(source, destination)
            raise

    def _make(self, folder: Path) -> None:
        missing = [path for path in (folder, *folder.parents) if not path.exists()]
        with _as_input_error(self.folder):
            for path in reversed(missing):
                self._created.append(path)
                path.mkdir(exist_ok=True)

    def _discard(self, *, keep_created: bool) -> None:
        if self._staging is not None:
            shutil.rmtree(self._staging, ignore_errors=True)
            self._staging = None
        for path in () if keep_created else reversed(self._created):
            with suppress(OSError):
                path.rmdir()
        self._created = []

    def _relative(self, name: str) -> PurePath:
        relative = PurePath(name)
        if not name or relative.is_absolute() or ".." in relative.parts:
            raise InputError(f"{name!r} is not a name in this folder", file=self.folder, allowed="a relative name")
        return relative


def _check_target(path: Path, force: bool) -> None:
    with _as_input_error(path):
        if path.is_dir():
            raise InputError(
                "this is a folder, but a file should be written here", file=path, remedy="choose another name"
            )
        if os.path.lexists(path) and not force:
            raise InputError("the file exists", file=path, remedy=_OVERWRITE, kind="file_exists")


@contextmanager
def _as_input_error(path: Path) -> Iterator[None]:
    try:
        yield
    except (OSError, ValueError) as error:
        raise InputError(f"cannot be written ({_reason(error)})", file=path, remedy="choose another folder") from error


def _reason(error: Exception) -> str:
    text = error.strerror if isinstance(error, OSError) else None
    return (text or str(error)).lower()

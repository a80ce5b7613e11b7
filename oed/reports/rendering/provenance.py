"""Where a report comes from: tool, versions, seed, command, and the files that it was computed from."""

from __future__ import annotations

import hashlib
import platform
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from itertools import pairwise
from pathlib import Path
from typing import Any

from oed.reports.rendering.command_lines import command_words, written
from robots.common.files import sha256
from robots.common.tables.times import YEAR_2000
from robots.signals import Log
from robots.version import VERSION

LIBRARIES = ("numpy", "scipy", "casadi", "pin")
"""Libraries whose version may change a result's last digits."""

LARGEST = 2e9
"""Files and folders above this size [bytes] are not hashed: it would take minutes."""

RESULTS = ("--out", "--report")
"""Options whose value is a file or folder that the command writes."""


@dataclass(frozen=True, kw_only=True)
class InputFile:
    """A file or folder that was read.

    Attributes:
        name: as it was typed.
        size: in bytes.
        modified: when it was written last.
        sha256: its digest, of a folder that of its files' digests; empty where it was not computed.
    """

    name: str
    size: int
    modified: str
    sha256: str


@dataclass(frozen=True, kw_only=True)
class Footer:
    """Where a page comes from.

    Args:
        tool: name and version of the tool.
        date: when the result was computed.
        command: the command that gives it again.
        seed: of the random numbers; None where there are none.
        versions: names and versions of what computed it.
        inputs: what the command read.
    """

    tool: str = ""
    date: str = ""
    command: str = ""
    seed: int | None = None
    versions: tuple[tuple[str, str], ...] = ()
    inputs: tuple[InputFile, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Recording:
    """A log of the first screen.

    Args:
        name: of the log.
        start: first time [s], from 1970 where the clock has a date; None where it is not known.
        duration: in s; None where it is not known.
    """

    name: str
    start: float | None = None
    duration: float | None = None

    @property
    def date(self) -> str:
        """When it was recorded; empty where its clock has no date."""
        if self.start is None or not self.start >= YEAR_2000:
            return ""
        return f"{datetime.fromtimestamp(self.start, UTC):%Y-%m-%d %H:%M} UTC"


def recordings_of(logs: Sequence[Mapping[str, Any]]) -> tuple[Recording, ...]:
    """Reads the logs that a model's provenance lists; those of older files state no start."""
    return tuple(
        Recording(name=str(log.get("name", "")), start=log.get("start"), duration=log.get("duration")) for log in logs
    )


def recordings_from(logs: Sequence[Log]) -> tuple[Recording, ...]:
    """Lists logs for the first screen.

    Args:
        logs: as they were read.
    """
    return tuple(Recording(name=log.name, start=float(log.t[0]), duration=log.duration) for log in logs)


def footer(seed: int | None = None) -> Footer:
    """Says which tool made the page, when, by which command, and from which files.

    Args:
        seed: of the random numbers, where the result states it; else that of the command line.
    """
    words = command_words()
    return Footer(
        tool=f"robot-oed {VERSION}",
        date=f"{datetime.now(UTC):%Y-%m-%d %H:%M} UTC",
        command=written(words),
        seed=_typed_seed(words) if seed is None else seed,
        versions=_versions(),
        inputs=tuple(_inputs(words)),
    )


def _versions() -> tuple[tuple[str, str], ...]:
    found = [("Python", platform.python_version())]
    for name in LIBRARIES:
        try:
            found.append((name, version(name)))
        except PackageNotFoundError:  # The library came without its metadata, as in some distributions.
            continue
    return tuple(found)


def _typed_seed(words: Sequence[str]) -> int | None:
    for word, following in zip(words, (*words[1:], ""), strict=True):
        value = following if word == "--seed" else word.removeprefix("--seed=") if word.startswith("--seed=") else ""
        if value.isdigit():
            return int(value)
    return None


def _inputs(words: Sequence[str]) -> Iterator[InputFile]:
    """Lists each word of the command line that names an existing file or folder, or ends with ``=`` and one."""
    seen: set[Path] = set()
    for before, word in pairwise(words):
        name = word.rpartition("=")[2]
        if before in RESULTS or word.startswith(RESULTS) or not name or name in seen:
            continue
        path = Path(name)
        # A bare word such as "er3a" may be a folder by chance: a name of the catalogue is no path.
        try:
            known = path.is_file() or (path.is_dir() and before.startswith("--") and before != "--robot")
        except OSError:
            continue
        if known and path not in seen:
            seen.add(path)
            yield _input(path)


def _input(path: Path) -> InputFile:
    files = [path] if path.is_file() else sorted(file for file in path.rglob("*") if file.is_file())
    size, latest = sum(file.stat().st_size for file in files), max((f.stat().st_mtime for f in files), default=0.0)
    digest = ""
    if size <= LARGEST and files:
        digests = [sha256(file) for file in files]
        digest = digests[0] if path.is_file() else hashlib.sha256("".join(digests).encode()).hexdigest()
    return InputFile(
        name=str(path),
        size=size,
        modified=f"{datetime.fromtimestamp(latest, UTC):%Y-%m-%d %H:%M} UTC" if latest else "",
        sha256=digest,
    )

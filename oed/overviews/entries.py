"""The results in a folder: one entry a file, whatever state the file is in."""

from __future__ import annotations

import html
import json
import os
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from pathlib import Path

from oed.overviews.kinds import BY_NAME, Figure, Reading, read_kind
from robots.common.errors import InputError
from robots.common.records.findings import ORDER, Level, severity

LARGEST = 64_000_000
"""Files above this size [bytes] are not read."""

HEAD = 4096
"""Where a report states its verdict, and a robot file its name [bytes]."""

PRIMARY = (
    "design.json",
    "calibration.json",
    "diagnosis.json",
    "monitor.json",
    "compare.json",
    "fleet.json",
    "campaign.json",
    "pareto.json",
)
"""Files that a report of their folder is about, whichever others lie beside them."""

REPORT = "report.html"

LONG = 4000
"""An array of numbers in so many bytes holds no key figure, but takes nearly all the time of reading a file."""

LARGE = 100_000
"""Files below this size [bytes] are read as a whole."""

_OF_ARRAYS = b"0123456789.,eE+-[]: \n\r\t"
_META = re.compile(r'<meta name="oed:(urgency|verdict)" content="([^"]*)">')
_ROBOT_YAML = re.compile(r"^(?:geometry|urdf):", re.MULTILINE)
_NAME_YAML = re.compile(r"^name:\s*[\"']?([^\"'#\n]+?)[\"']?\s*(?:#.*)?$", re.MULTILINE)
_ROBOT_URDF = re.compile(r"<robot\b[^>]*?\bname=[\"']([^\"']*)[\"']", re.DOTALL)


@dataclass(frozen=True, kw_only=True)
class Entry:
    """One result.

    Attributes:
        path: of its file, from the folder on, with forward slashes.
        kind: in words.
        robot: its name; empty where the file states none.
        date: when the file was written (UTC).
        level: how urgent it is; None without a judgement.
        verdict: in one sentence.
        figures: by their labels with units.
        report: path of its report; empty without one.
    """

    path: str
    kind: str
    robot: str = ""
    date: str = ""
    level: Level | None = None
    verdict: str = ""
    figures: Mapping[str, Figure] = field(default_factory=dict)
    report: str = ""


def find_results(folder: str | Path) -> tuple[Entry, ...]:
    """Finds the results of this program in a folder and its sub-folders.

    Broken files and files of another version give an entry that says so. Links that lead out of the folder are not
    followed.

    Args:
        folder: where results are.

    Returns:
        The most urgent first, then the newest.

    Raises:
        InputError: no such folder, or a file.
    """
    root = Path(folder)
    if not root.is_dir():
        found = "a file, not a folder" if root.exists() else "no such folder"
        raise InputError(found, file=folder, remedy="give the folder that holds results")
    entries = [entry for place in _folders(root) for entry in _entries(root, *place)]
    entries.sort(key=lambda entry: entry.path)
    entries.sort(key=lambda entry: entry.date, reverse=True)
    return tuple(
        sorted(entries, key=lambda entry: -1 if entry.level is None else ORDER.index(entry.level), reverse=True)
    )


def _folders(root: Path) -> Iterator[tuple[Path, list[str]]]:
    for place, folders, names in os.walk(root):
        folders[:] = sorted(name for name in folders if not name.startswith("."))
        yield Path(place), sorted(name for name in names if not name.startswith("."))


def _entries(root: Path, place: Path, names: list[str]) -> list[Entry]:
    found = [entry for name in names if (entry := _entry(root, place / name)) is not None]
    results = [entry for entry in found if entry.kind not in ("robot", "unreadable")]
    if REPORT not in names or not results:
        return found
    report = (place / REPORT).relative_to(root).as_posix()
    first = next((e for name in PRIMARY for e in results if Path(e.path).name == name), results[0])
    stated = _stated(place / REPORT)
    level, verdict = stated.get("urgency"), stated.get("verdict")
    reported = replace(first, report=report)
    if verdict and level in ORDER and first.kind != "other version":
        reported = replace(reported, level=next(known for known in ORDER if known == level), verdict=verdict)
    return [reported if entry is first else entry for entry in found]


def _entry(root: Path, path: Path) -> Entry | None:
    """Reads one file; None if it is not a result."""
    suffix = path.suffix.lower()
    if suffix not in (".json", ".state", ".yaml", ".yml", ".urdf"):
        return None
    entry = Entry(path=path.relative_to(root).as_posix(), kind="unreadable")
    try:
        if path.is_symlink() and not path.resolve().is_relative_to(root.resolve()):
            return None
        facts = path.stat()
        entry = replace(entry, date=f"{datetime.fromtimestamp(facts.st_mtime, UTC):%Y-%m-%d %H:%M}")
        if suffix in (".yaml", ".yml", ".urdf"):
            name = _robot_name(path)
            found = replace(entry, kind="robot", robot=name or "", verdict="Description of a robot.")
            return None if name is None else found
        if facts.st_size > LARGEST:
            return replace(entry, verdict=f"Not read: {facts.st_size / 1e6:.0f} MB is too large.")
        data = _parsed(path.read_bytes())
    except (OSError, ValueError, RecursionError) as error:
        reason = error.strerror if isinstance(error, OSError) else "it is no whole JSON file"
        if suffix == ".state":
            return None
        return replace(entry, level="note", verdict=f"The file cannot be read: {reason}.")
    if not isinstance(data, Mapping):
        return None
    try:
        reading = read_kind(path.name, data)
    except (InputError, LookupError, TypeError, ValueError, AttributeError, ArithmeticError) as error:
        if not isinstance(data.get("format"), str) and path.name in BY_NAME and not data.keys() & {"verdict", "limits"}:
            return None
        what = f"the field {error} is missing" if isinstance(error, KeyError) else "a field has another form"
        if isinstance(error, InputError) and error.column:
            what = f"the field {error.column!r}: {error.problem}"
        text = f"Written by another version of oed: {what}. Make it again, or open its file."
        return replace(entry, kind="other version", level="note", verdict=text)
    return None if reading is None else _filled(entry, reading)


def _filled(entry: Entry, reading: Reading) -> Entry:
    return replace(
        entry,
        kind=reading.kind,
        robot=reading.robot,
        level=severity(reading.codes) if reading.codes else None,
        verdict=reading.verdict,
        figures=reading.figures,
    )


def _parsed(content: bytes) -> object:
    if len(content) < LARGE:
        return json.loads(content)
    try:
        # Nothing but numbers and brackets lies between two quotation marks around an array of numbers.
        return json.loads(b'"'.join(map(_emptied, content.split(b'"'))))
    except ValueError:
        return json.loads(content)


def _emptied(part: bytes) -> bytes:
    """Takes the numbers out of a long array."""
    if len(part) < LONG or part.translate(None, _OF_ARRAYS) or part.count(b"[") != part.count(b"]"):
        return part
    before, _, _ = part.partition(b"[")
    _, _, after = part.rpartition(b"]")
    return before + b"[]" + after


def _stated(report: Path) -> dict[str, str]:
    """What a report says of itself; nothing of one by an older version."""
    try:
        with report.open("rb") as stream:
            head = stream.read(HEAD).decode("utf-8", errors="replace")
    except OSError:
        return {}
    return {name: html.unescape(text) for name, text in _META.findall(head)}


def _robot_name(path: Path) -> str | None:
    with path.open("rb") as stream:
        head = stream.read(HEAD).decode("utf-8", errors="replace")
    if path.suffix.lower() == ".urdf":
        match = _ROBOT_URDF.search(head)
        return match[1] if match else None
    match = _NAME_YAML.search(head)
    return match[1] if match and _ROBOT_YAML.search(head) else None

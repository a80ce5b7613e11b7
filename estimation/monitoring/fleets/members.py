"""The robots of a fleet: folders with logs, or files in one folder."""

from __future__ import annotations

from dataclasses import dataclass
from os import PathLike
from pathlib import Path

from estimation.logs.campaigns import in_natural_order
from estimation.logs.formats import SUFFIXES, is_log_name
from robots.common.errors import InputError

MODEL = "model.json"
# Folders of a partitioned data set are called column=value.
PARTITION = "robot="


@dataclass(frozen=True, kw_only=True)
class Member:
    """One robot.

    Attributes:
        name: of the robot.
        files: its logs, in natural order of their names.
        model: its own model, where its folder holds one.
    """

    name: str
    files: tuple[Path, ...]
    model: Path | None = None

    def absolute(self) -> Member:
        """Gives the same robot with absolute paths."""
        model = None if self.model is None else self.model.absolute()
        return Member(name=self.name, files=tuple(path.absolute() for path in self.files), model=model)


def find_members(folder: str | PathLike[str]) -> list[Member]:
    """Finds the robots of a fleet.

    A sub-folder is a robot, with all logs below it, and with a `model.json` of its own if there is one. Folders of a
    Parquet data set that is partitioned by robot are called ``robot=NAME``. A log directly in the folder is a robot of
    that name.

    Args:
        folder: of the fleet.

    Raises:
        InputError: no folder, or no logs in it.
    """
    place = Path(folder)
    if not place.is_dir():
        raise InputError("no such folder", file=place, remedy="give the folder that holds the robots' logs")
    members = []
    for entry in sorted(place.iterdir()):
        if entry.name.startswith("."):
            continue
        if is_log_name(entry):
            members.append(Member(name=entry.stem, files=(entry,)))
        elif entry.is_dir():
            files = tuple(in_natural_order(_logs_below(entry)))
            if files:
                own = entry / MODEL
                name = entry.name.removeprefix(PARTITION)
                members.append(Member(name=name, files=files, model=own if own.is_file() else None))
    if not members:
        raise InputError(
            "no logs in the folder",
            file=place,
            allowed="a folder per robot, or a log per robot: " + ", ".join(SUFFIXES),
            kind="no_logs",
        )
    names = [member.name for member in members]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise InputError(f"two robots of the name {twice}", file=place, remedy="rename one of the folders or logs")
    return members


def _logs_below(folder: Path) -> list[Path]:
    found = []
    for entry in folder.iterdir():
        if entry.name.startswith("."):
            continue
        if is_log_name(entry):
            found.append(entry)
        elif entry.is_dir():
            found += _logs_below(entry)
    return found

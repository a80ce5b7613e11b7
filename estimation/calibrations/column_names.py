"""Names of columns as trackers and controllers write them, with units in brackets, and files without poses."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from robots.common.errors import InputError

UNIT = re.compile(r"\s*[\[(]\s*([^\])]*?)\s*[\])]\s*$")
UNITS = {"degree": "deg", "degrees": "deg", "\N{DEGREE SIGN}": "deg", "radian": "rad", "radians": "rad"}
UNITS |= {"millimeters": "mm", "millimetres": "mm", "meters": "m", "metres": "m"}

NAMES = (
    (re.compile(r"(?:q|j|a|joint|axis|theta)[ _]?(\d+)(?:[ _]pos(?:ition)?)?"), r"q\1"),
    (re.compile(r"(?:position|pos|p|translation)[ _]?([xyz])"), r"\1"),
    (re.compile(r"(?:rotation|rot|quaternion|quat|orientation|q)[ _]?([xyzw])"), r"q\1"),
)
"""Names of joints, positions and quaternions, in lower case, and what they are called here."""

RECORDINGS = (("Format Version", "OptiTrack's Motive"), ("NO_OF_FRAMES", "Qualisys"), ("Trajectories", "Vicon's Nexus"))
"""How files of motion capture begin that have a row for each frame."""


def column_names(stored: Sequence[str]) -> tuple[dict[str, str], dict[str, str | None]]:
    """Finds what columns are called here.

    ``J1 [deg]``, ``A1``, ``joint_1`` and ``axis 1`` are ``q1``; ``Position X`` is ``x``, ``Rotation W`` is ``qw``.
    A name that is right as it stands goes before.

    Args:
        stored: names in the file.

    Returns:
        The stored name by the one here, in lower case, and the unit that it states or None.
    """
    names: dict[str, str] = {}
    units: dict[str, str | None] = {}
    plain = [(UNIT.sub("", name.strip()).lower(), name) for name in stored]
    renamed = [(_renamed(name), own) for name, own in plain]
    for name, own in (*plain, *renamed):
        if name not in names:
            found = UNIT.search(own)
            unit = found.group(1).lower() if found else None
            names[name], units[name] = own, UNITS.get(unit, unit) if unit else None
    return names, units


def _renamed(name: str) -> str:
    for pattern, here in NAMES:
        if pattern.fullmatch(name):
            return pattern.sub(here, name)
    return name


def refuse_recordings(path: Path) -> None:
    """Refuses exports of motion capture, which have a row for each frame and no joint positions.

    Args:
        path: a file.

    Raises:
        InputError: with what to do.
    """
    if path.suffix.lower() not in (".csv", ".tsv", ".txt") or not path.is_file():
        return
    with path.open(encoding="utf-8", errors="replace") as stream:
        first = stream.readline().lstrip('\ufeff"')
    system = next((system for start, system in RECORDINGS if first.startswith(start)), None)
    if system is not None:
        raise InputError(
            f"an export of {system}, with a row for each frame and no joint positions",
            file=path,
            allowed="a row for each pose, with q1..qn and what was measured there",
            remedy="average the frames in which the robot rests at a pose, and put the joint positions beside them",
        )

"""Descriptions of installed packages, read one by one: a table of what was read, what was refused, and why.

Run it with ``python benchmarks/descriptions.py [FOLDER ...]``: folders of installed or unpacked packages, by default
example-robot-data of this environment. Of a description with branches the longest chain is taken. Files without a
moving joint, such as a table, and xacro files that are parts of others, are no robots. The exit code is 1 if less than
``--least`` of the robots were read.
"""

from __future__ import annotations

import argparse
import re
import sys
import warnings
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from robots.common.errors import InputError
from robots.geometry.urdf import UrdfTree, read_urdf
from robots.loading import load_robot
from robots.mujoco_models.elements import read_model
from robots.mujoco_models.files import compile_mjcf, mujoco_library, read_xml
from robots.robot import Robot

NO_ROBOT = ("has no joint", "no joint moves", "no hinge and no slide")
BRANCHES = "branches into"
MJCF = re.compile(rb"<mujoco\b")
# A macro file defines parts for others: it has no robot of its own.
WHOLE = re.compile(rb"<robot\b(?=[^>]*\bname=)")


@dataclass(frozen=True)
class Row:
    """What became of one file."""

    file: str
    outcome: str
    detail: str


def installed() -> list[Path]:
    """The folders of example-robot-data in this environment."""
    return sorted(Path(sys.prefix).glob("lib/python*/site-packages/cmeel.prefix/share/example-robot-data"))


def descriptions(folder: Path) -> Iterator[Path]:
    """All URDF files, xacro files of whole robots, and MJCF files that others do not include."""
    parts = set()
    models = []
    for path in sorted(folder.rglob("*")):
        if not path.is_file() or any(part.endswith(".dist-info") for part in path.parts):
            continue
        if path.suffix == ".urdf" or (path.suffix == ".xacro" and WHOLE.search(path.read_bytes())):
            yield path
        elif path.suffix == ".xml" and MJCF.search(path.read_bytes()):
            models.append(path)
            found = re.findall(rb'<include\s+file="([^"]+)"', path.read_bytes())
            parts |= {(path.parent / name.decode()).resolve() for name in found}
    yield from (path for path in models if path.resolve() not in parts)


def tree_of(path: Path) -> UrdfTree:
    """All links and joints of a file."""
    if path.suffix != ".xml":
        return read_urdf(path)
    name = str(path)
    model = read_model(
        mujoco_library(path), compile_mjcf(path), file=name, name=path.stem, digest=read_xml(path).digest, unused=()
    )
    return UrdfTree(model, kind="MJCF")


def longest(path: Path) -> tuple[Robot, str]:
    """The robot of the longest chain, and its tip; joints that mimic others follow them."""
    tree = tree_of(path)

    def free(leaf: str) -> list[str]:
        return [joint.name for joint in tree.path(leaf) if joint.moves and joint.mimic is None]

    tip = max(tree.leaves, key=lambda leaf: len(free(leaf)))
    return load_robot(path, tip=tip, joints=free(tip), unlimited=True), tip


def read(path: Path, folder: Path) -> Row:
    """Reads one file."""
    file = str(path.relative_to(folder))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            try:
                robot, chosen = load_robot(path, unlimited=True), ""
            except InputError as error:
                if BRANCHES not in error.problem and "mimics" not in error.problem:
                    raise
                robot, tip = longest(path)
                chosen = f", tip {tip}"
        except InputError as error:
            part = path.suffix == ".xacro" and "the parent link" in error.problem
            outcome = "no robot" if part or any(text in error.problem for text in NO_ROBOT) else "refused"
            place = "" if error.joint is None else f"joint {error.joint}: "
            return Row(file, outcome, place + error.problem)
    known = np.isfinite(robot.inertia).all(axis=1)
    masses = "all" if known.all() else "no" if not known.any() else f"{known.sum()} of {robot.n}"
    lacking = [
        name
        for name, values in (
            ("position", robot.limits.upper - robot.limits.lower),
            ("velocity", robot.limits.velocity),
            ("torque", robot.limits.torque),
        )
        if not np.isfinite(values).all()
    ]
    limits = "all limits" if not lacking else f"not all limits of {', '.join(lacking)}"
    return Row(file, "read", f"{robot.n} joints, {masses} masses, {limits}{chosen}")


def package_name(folder: Path) -> str:
    """Name and version of the package in a folder."""
    for path in sorted(folder.glob("*.dist-info/METADATA")):
        head = dict(re.findall(r"^(Name|Version): (.*)$", path.read_text(encoding="utf-8"), re.MULTILINE))
        return f"{head['Name']} {head['Version']}"
    if (folder / "package.xml").is_file():
        version = re.search(r"<version>([^<]+)</version>", (folder / "package.xml").read_text(encoding="utf-8"))
        return f"{folder.name} {version[1] if version else ''}"
    return folder.name


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folders", nargs="*", type=Path, help="folders of packages")
    parser.add_argument("--brief", action="store_true", help="only refusals, and the sums of each package")
    parser.add_argument("--least", type=float, default=0.9, help="share of the robots that must be read")
    options = parser.parse_args()
    folders = options.folders or installed()
    if not folders:
        print("example-robot-data is not installed (pip install example-robot-data), and no folder is given")
        return 1
    total: Counter[str] = Counter()
    for folder in folders:
        rows = [read(path, folder) for path in descriptions(folder)]
        shown = [row for row in rows if row.outcome == "refused" or not options.brief]
        counts = Counter(row.outcome for row in rows)
        total += counts
        unknown = sum(" no masses" in row.detail or " of " in row.detail.partition(" masses")[0] for row in rows)
        print(
            f"{package_name(folder)}: {len(rows)} files, {counts['read']} read ({unknown} without all masses), "
            f"{counts['refused']} refused, {counts['no robot']} without a moving joint"
        )
        width = max((len(row.file) for row in shown), default=0)
        for row in shown:
            print(f"  {row.file.ljust(width)}  {row.outcome:8}  {row.detail}")
    robots = total["read"] + total["refused"]
    share = total["read"] / max(robots, 1)
    print(f"all: {total['read']} of {robots} robots read ({100 * share:.1f} %)")
    return 0 if share >= options.least else 1


if __name__ == "__main__":
    sys.exit(main())

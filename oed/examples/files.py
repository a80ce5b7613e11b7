"""Files to try the commands on: a virtual robot whose joint 2 has a cable that the description does not contain."""

from __future__ import annotations

from importlib.resources import files
from os import PathLike
from pathlib import Path

from robots.common.files import ResultFolder, write_atomic

ROBOT = "er3a"
DATA = ("plant.yaml", "worn.yaml", "log.csv", "held_out.csv")
FILES = ("robot.yaml", *DATA)
"""What is written: the robot's description; the virtual robot, new and worn; two logs of the worn one."""


def write_example(folder: str | PathLike[str], *, force: bool = False) -> tuple[Path, ...]:
    """Writes the example files.

    Args:
        folder: made if need be.
        force: whether existing files of these names may be replaced.

    Returns:
        The files.

    Raises:
        InputError: one of the files exists, or the folder cannot be written to.
    """
    sources = {"robot.yaml": files("robots.catalog") / f"{ROBOT}.yaml"}
    sources |= {name: files("oed.examples") / name for name in DATA}
    with ResultFolder(folder, force, names=FILES) as out:
        for name in FILES:
            write_atomic(out.path(name), sources[name].read_bytes())
    return tuple(Path(folder) / name for name in FILES)


def next_commands(folder: str | PathLike[str]) -> tuple[str, str, str]:
    """Gives the command lines that use the example files.

    Args:
        folder: with the files.
    """
    place = Path(folder)
    robot, log, held_out = place / "robot.yaml", place / "log.csv", place / "held_out.csv"
    model, diagnosed = place / "model", place / "diagnosed"
    return (
        f"oed identify --robot {robot} --log {log} --out {model}",
        f"oed diagnose --robot {robot} --log {log} --held-out {held_out} --out {diagnosed}",
        f"oed predict --model {diagnosed} --log {held_out} --out {place / 'predicted.csv'}",
    )

"""Verdicts of the gate: on measured logs whole and in parts, foreign and mangled ones, and published failures."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks import mangled_logs, torque_columns
from benchmarks.diagnosis_real import SETS
from estimation import check_log, read_log
from robots import load_robot
from robots.common.errors import OedError
from robots.robot import Robot
from robots.signals import Log

# Logs are checked whole, halved and thirded.
PARTS = (1, 2, 3)
MANGLED = 300
SEED = 11
# Endings of what a reader takes, in the folders of published failures.
LOGS = (".csv", ".parquet")


def check_measured(name: str, folder: Path) -> dict[str, Any]:
    """Checks each log of a published set whole, halved and thirded."""
    with tempfile.TemporaryDirectory() as out:
        given = SETS[name](folder, Path(out))
        logs = [*given.logs, *(given.unseen or ())]
        return {
            f"{k}, {part}": _verdict(given.robot, piece) for k, log in enumerate(logs) for part, piece in _parts(log)
        }


def _parts(log: Log) -> Iterator[tuple[str, Log]]:
    for count in PARTS:
        edges = np.linspace(0, len(log), count + 1).astype(int)
        for k, (first, stop) in enumerate(pairwise(edges.tolist())):
            yield f"{k + 1} of {count}", log if count == 1 else log.rows(slice(first, stop))


def _verdict(robot: Robot, log: Log) -> dict[str, Any]:
    try:
        return check_log(robot, log).to_dict()
    except OedError as error:
        return {"refused": type(error).__name__, "text": str(error)}


def check_foreign(name: str, seed: int) -> dict[str, Any]:
    """Checks logs of one virtual robot whose torque columns have another meaning, and a right one."""
    robot = torque_columns.described(name)
    plain = replace(robot, friction=np.zeros((robot.n, 4)))
    return {kind: _verdict(plain, torque_columns.log_of(robot, kind, seed)) for kind in torque_columns.KINDS}


def check_mangled(number: int) -> dict[str, Any]:
    """Reads, checks and identifies one mangled log."""
    with tempfile.TemporaryDirectory() as folder:
        case = mangled_logs.run_case(number, SEED, Path(folder))
    return {
        "kind": case.kind,
        "ways": list(case.ways),
        "result": case.result,
        "detail": case.detail.replace(folder, ""),
    }


def check_published(folder: Path) -> dict[str, Any]:
    """Reads and checks the logs of one published failure, with the robot that its README names for each."""
    text = (folder / "README.md").read_text(encoding="utf-8")
    (first, *_) = re.findall(r"--robot (\S+)", text) or ["er3a"]
    found: dict[str, Any] = {}
    for path in sorted(p for p in folder.rglob("*") if p.suffix in LOGS):
        robot = dict(re.findall(rf"(?:check|--log) ({re.escape(path.name)}) --robot (\S+)", text)).get(path.name, first)
        robot = robot.strip("`;,")
        try:
            described = load_robot(folder / robot if (folder / robot).exists() else robot)
            found[path.name] = _verdict(described, read_log(path, described.n, joints=described.joint_names))
        except OedError as error:
            found[path.name] = {"refused": type(error).__name__, "text": str(error)}
    return found

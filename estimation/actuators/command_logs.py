"""Logs with commands, of robots with branches: their joints in the order of the chains."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from estimation.logs import read_logs
from estimation.logs.mappings.mapping import LogMapping
from estimation.logs.readers.lerobot import is_lerobot, read_lerobot
from robots.robot import Robot
from robots.signals import Log


def read_command_logs(
    paths: Sequence[Path],
    chains: Sequence[Robot],
    *,
    joints: Sequence[str] | None = None,
    mapping: LogMapping | Path | None = None,
) -> list[Log]:
    """Reads logs with commands: files of any known format, and LeRobot data sets.

    Args:
        paths: files and folders; none for no logs.
        chains: of the robot.
        joints: names of the log's joints in its order; by default that of the chains.
        mapping: of the logs' columns.

    Returns:
        Logs whose joints are in the order of the chains.

    Raises:
        InputError: see `read_logs` and `read_lerobot`.
    """
    if not paths:
        return []
    own = [name for chain in chains for name in chain.joint_names]
    names = list(joints or own)
    # Where each joint of the chains is in the log, and the other way round.
    places = [names.index(name) for name in own]
    back = [places.index(column) for column in range(len(places))]
    kinds = [kind for chain in chains for kind in chain.chain.kinds]
    sets = [path for path in paths if is_lerobot(path)]
    files = [path for path in paths if path not in sets]
    settings: dict[str, Any] = {"n": len(names), "torque": False, "mapping": mapping, "joints": tuple(names)}
    found = list(read_logs(files, kinds=tuple(kinds[k] for k in back), **settings)) if files else []
    # Normalised positions of a data set are read by the joints' limits.
    lower = np.array([float(value) for chain in chains for value in chain.limits.lower])[back]
    upper = np.array([float(value) for chain in chains for value in chain.limits.upper])[back]
    for path in sets:
        found += read_lerobot(path, tuple(names), (lower, upper))
    return [_in_order(log, places) for log in found]


def _in_order(log: Log, places: list[int]) -> Log:
    if places == sorted(places):
        return log
    columns = ("q", "command", "tau", "current", "dq", "ddq", "temperature", "qlink")
    return replace(log, **{key: getattr(log, key)[:, places] for key in columns if getattr(log, key) is not None})

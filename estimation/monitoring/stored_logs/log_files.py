"""Logs from files that may be corrupt: a corrupt file costs one row, not the run."""

from __future__ import annotations

from collections.abc import Sequence
from os import PathLike
from pathlib import Path

from estimation.logs.campaigns import log_files
from estimation.logs.mappings.mapping import LogMapping
from estimation.logs.reading import read_log
from estimation.monitoring.log_row import LogRow
from robots.common.errors import InputError
from robots.robot import Robot
from robots.signals import Log


def read_each(
    files: Sequence[Path], robot: Robot, mapping: LogMapping | str | PathLike[str] | None = None
) -> tuple[list[Log], list[LogRow]]:
    """Reads logs one by one.

    Args:
        files: of the logs, in the order in which they were recorded.
        robot: of the model.
        mapping: of their columns, where they need one.

    Returns:
        The logs, and a row with the reason for each file that cannot be read.
    """
    logs, refused = [], []
    for file in files:
        try:
            logs.append(read_log(file, mapping=mapping, joints=robot.joint_names, kinds=robot.chain.kinds))
        except InputError as error:
            refused.append(LogRow.left_out(file.stem, str(error)))
    return logs, refused


def read_monitored(
    paths: Sequence[Path],
    folder: Path | None,
    robot: Robot,
    mapping: LogMapping | str | PathLike[str] | None = None,
) -> tuple[list[Log], list[LogRow]]:
    """Reads logs to monitor: those that are named must be readable, those of a folder need not.

    Args:
        paths: of logs and of folders of logs.
        folder: of logs; some may be corrupt.
        robot: of the model.
        mapping: of the logs' columns.

    Returns:
        The logs, and a row with the reason for each file of the folder that cannot be read.

    Raises:
        InputError: a named log that cannot be read, or a folder without any log that can.
    """
    named = [file for path in paths for file in (log_files(path) if path.is_dir() else [path])]
    logs = [read_log(file, mapping=mapping, joints=robot.joint_names, kinds=robot.chain.kinds) for file in named]
    more, refused = ([], []) if folder is None else read_each(log_files(folder), robot, mapping)
    if not logs and not more:
        raise InputError("no log in the folder can be read", file=folder, remedy=refused[0].note)
    return [*logs, *more], refused

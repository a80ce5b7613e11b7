"""A list of waypoints as a file: positions without times."""

from __future__ import annotations

from os import PathLike

import numpy as np
from numpy.typing import NDArray

from oed.exports.trajectory_csv import JOINT_COLUMN, read_lengths
from robots.common.errors import InputError
from robots.common.tables.table_files import read_table

Array = NDArray[np.float64]


def read_waypoints(path: str | PathLike[str], n: int | None = None) -> Array | None:
    """Reads waypoints from a CSV with the columns q1..qn and no time.

    Columns in degrees or millimetres, as an ECSV block states them, become radians or metres.

    Args:
        path: the file.
        n: number of joints, if known.

    Returns:
        The waypoints (W, n) [rad or m]; None where the file has a column of times, so that it is a trajectory.

    Raises:
        InputError: another number of joints, an unknown unit, text or NaN in a cell, or fewer than two waypoints.
    """
    table = read_table(path, wanted=lambda name: name == "t" or JOINT_COLUMN.fullmatch(name) is not None)
    if "t" in table.columns:
        return None
    found = sorted(int(match[2]) for match in map(JOINT_COLUMN.fullmatch, table.names) if match and match[1] == "q")
    n = n or max(found, default=1)
    if found != list(range(1, n + 1)):
        names = ", ".join(f"q{joint}" for joint in found) or "no columns q1, q2, ..."
        raise InputError(f"found {names}", file=path, allowed=f"q1 to q{n}, one waypoint a row")
    q = np.column_stack([read_lengths(table, "q", joint) for joint in range(1, n + 1)])
    if len(q) < 2:
        raise InputError(f"{len(q)} waypoints", file=path, allowed="two or more")
    return q

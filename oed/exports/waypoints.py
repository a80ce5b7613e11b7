"""A list of waypoints as a file: positions without times."""

from __future__ import annotations

import warnings
from os import PathLike

import numpy as np
from numpy.typing import ArrayLike

from oed.exports.trajectory_csv import JOINT_COLUMN, read_lengths
from robots.common.arrays import Array
from robots.common.errors import InputError, ShorterWayWarning
from robots.common.plain import joints_in_words, several
from robots.common.tables.table_files import Table, read_table
from robots.robot import Robot

POSITION_ROUNDING = 1e-6
"""What a file rounds [rad or m]."""


def read_waypoints(path: str | PathLike[str], n: int | None = None, *, robot: Robot | None = None) -> Array | None:
    """Reads waypoints from a CSV with the columns q1..qn and no time.

    Columns in degrees or millimetres, as an ECSV block states them, become radians or metres.

    Args:
        path: the file.
        n: number of joints, if known.
        robot: whose joints they are, if known: units and limits are checked, and `shorter_way` is taken.

    Returns:
        The waypoints (W, n) [rad or m]; None where the file has a column of times, so that it is a trajectory.

    Raises:
        InputError: another number of joints, an unknown unit or one of another kind of joint, text or NaN in a cell,
            a waypoint outside the limits, or fewer than two waypoints.
    """
    table = read_table(path, wanted=lambda name: name == "t" or JOINT_COLUMN.fullmatch(name) is not None)
    if "t" in table.columns:
        return None
    found = sorted(int(match[2]) for match in map(JOINT_COLUMN.fullmatch, table.names) if match and match[1] == "q")
    n = n or (max(found, default=1) if robot is None else robot.n)
    if found != list(range(1, n + 1)):
        names = ", ".join(f"q{joint}" for joint in found) or "no columns q1, q2, ..."
        raise InputError(f"found {names}", file=path, allowed=f"q1 to q{n}, one waypoint a row")
    q = np.column_stack([read_lengths(table, "q", joint) for joint in range(1, n + 1)])
    if len(q) < 2:
        raise InputError(several(len(q), "waypoint"), file=path, allowed="two or more")
    if robot is not None:
        _check_units(table, robot)
        _check_limits(q, table, robot)
        q = shorter_way(robot, q)
    return q


def shorter_way(robot: Robot, waypoints: ArrayLike) -> Array:
    """Turns joints without end the shorter way from waypoint to waypoint.

    Planners keep the angles of such joints in one turn, so that they jump where a joint passes its end. A column that
    spans more than a turn counts turns, and is left as it is.

    Args:
        robot: whose joints they are.
        waypoints: (W, n) [rad or m].

    Returns:
        The same poses (W, n).

    Warns:
        ShorterWayWarning: naming the joints and the first two waypoints, where angles have changed.
    """
    q = np.array(waypoints, dtype=np.float64)
    if q.ndim != 2 or q.shape[1] != robot.n or not np.isfinite(q).all():
        return q  # Those that use them say what is wrong.
    within = robot.endless & (np.ptp(q, axis=0) <= 2 * np.pi + POSITION_ROUNDING)
    jumps = (np.abs(np.diff(q, axis=0)) > np.pi + POSITION_ROUNDING) & within
    joints = np.flatnonzero(jumps.any(axis=0))
    for joint in joints:
        q[:, joint] = np.unwrap(q[:, joint])
    if joints.size:
        names = joints_in_words(robot.joint_names[joint] for joint in joints)
        row = int(np.flatnonzero(jumps.any(axis=1))[0]) + 1
        text = (
            f"{robot.name}: where waypoints jump by more than half a turn, first from {row} to {row + 1}, the shorter "
            f"way is taken, because there are no position limits: {names}. For the longer way, put a waypoint between"
        )
        warnings.warn(ShorterWayWarning(text), stacklevel=2)
    return q


def _check_units(table: Table, robot: Robot) -> None:
    for joint, kind in enumerate(robot.chain.kinds, start=1):
        unit, allowed = table.units.get(f"q{joint}"), ("m", "mm") if kind == "prismatic" else ("rad", "deg")
        if unit is not None and unit not in allowed:
            raise InputError(
                f"unit {unit!r} of a {kind} joint of {robot.name}",
                file=table.path,
                column=f"q{joint}",
                allowed=" or ".join(allowed),
            )


def _check_limits(q: Array, table: Table, robot: Robot) -> None:
    limits = robot.limits
    outside = np.argwhere((q < limits.lower - POSITION_ROUNDING) | (q > limits.upper + POSITION_ROUNDING))
    if outside.size:
        row, joint = (int(index) for index in outside[0])
        raise InputError(
            f"{q[row, joint]:.6g} {limits.unit(joint)} is outside the limits of {robot.name}",
            file=table.path,
            column=f"q{joint + 1}",
            row=table.line(row),
            allowed=f"{limits.lower[joint]:.6g} to {limits.upper[joint]:.6g} {limits.unit(joint)}",
            remedy="positions are in rad and m, unless the file states deg or mm in an ECSV block",
        )

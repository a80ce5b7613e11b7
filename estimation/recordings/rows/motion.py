"""Which joints move, and in which rows."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from estimation.recordings.rows.columns import Columns
from estimation.regressions.preparation import TREMBLE_SHARE
from robots.common.arrays import Array
from robots.robot import Robot
from robots.signals import Log

# A row is in motion if a joint changes within this time before and after it [s], by this share of its travel.
AROUND, CHANGE = 0.05, 1e-3
# Share of a joint's range, or of a turn, below which it hardly moves.
HARDLY = 0.01
# A joint is beyond a limit by more than this share of its range: limits of a URDF are often not exact. Without limits,
# it is beyond its range from so many turns on.
BEYOND, TURNS = 0.25, 8.0


def moving_rows(log: Log, columns: Columns, steps: float = 0.0) -> NDArray[np.bool_]:
    """Finds the rows (N,) in which any joint moves.

    Args:
        log: the log.
        columns: of the log.
        steps: encoder steps per row by which a joint must move, at least.
    """
    half = max(2, round(AROUND * (len(log) - 1) / max(log.duration, 1e-300)))
    half = min(half, (len(log) - 1) // 2)
    if not half:
        return np.zeros(len(log), dtype=bool)
    moving = np.zeros(len(log) - 2 * half, dtype=bool)
    for joint, (q, travel) in enumerate(zip(columns.q, columns.travel, strict=True)):
        if travel > 0:
            least = max(CHANGE * travel, 2 * half * steps * columns.position_steps[joint] if steps else 0.0)
            moving |= np.abs(q[2 * half :] - q[: -2 * half]) > least
    edge = np.zeros(half, dtype=bool)
    return np.concatenate([edge, moving, edge])


def travel_shares(robot: Robot, q: Array) -> Array:
    """Divides the travel of each joint by its range, or by a turn if that is less (n,).

    Args:
        robot: with n joints.
        q: positions (N, n), or the lowest and highest ones (2, n).
    """
    range_ = np.asarray(robot.limits.upper) - np.asarray(robot.limits.lower)
    range_ = np.where(np.isfinite(range_), range_, 2 * np.pi)
    return np.asarray(np.ptp(q, axis=0) / np.maximum(np.minimum(range_, 2 * np.pi), 1e-12))


def beyond_limits(robot: Robot, q: Array) -> NDArray[np.bool_]:
    """Finds the joints (n,) whose positions are beyond their limits, by more than these are inexact.

    Args:
        robot: with n joints.
        q: positions (N, n), or the lowest and highest ones (2, n).
    """
    lower, upper = np.asarray(robot.limits.lower, dtype=float), np.asarray(robot.limits.upper, dtype=float)
    low, high = q.min(axis=0), q.max(axis=0)
    known = np.isfinite(lower) & np.isfinite(upper)
    slack = np.where(known, BEYOND * np.maximum(upper - lower, 1e-9), 0.0)
    lower, upper = np.where(known, lower - slack, -TURNS * 2 * np.pi), np.where(known, upper + slack, TURNS * 2 * np.pi)
    return np.asarray((low < lower) | (high > upper))


def standing_joints(robot: Robot, columns: Columns) -> NDArray[np.bool_]:
    """Finds the joints (n,) that stand still.

    A position that changes by some encoder steps only is the error of the position loop. Neither such a motion nor its
    torque says anything about the joint: friction may have any value that holds it.

    Args:
        robot: with n joints.
        columns: of the log.
    """
    stands: NDArray[np.bool_] = travel_shares(robot, columns.extremes) < TREMBLE_SHARE
    return stands

"""A joint that turns the other way than the robot's description says."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from estimation.gate.excerpts import Excerpt
from estimation.gate.finding import Finding
from estimation.gate.quick_fit import Rows, fit_all
from robots.robot import Robot

Array = NDArray[np.float64]

# Below this unexplained share of the torque nothing is turned.
WELL = 0.1
# How much better (mean log error) the torques must be explained with a joint turned to be told, and to be beyond doubt.
BETTER, CERTAIN = 0.2, 0.5
# Rows that are enough to see it.
ROWS = 1500


def check_orientations(robot: Robot, rows: Rows, spread: Array) -> list[Finding]:
    """Turns one joint after the other, with and without its torque, and sees whether the torques are explained better.

    Args:
        robot: with n joints.
        rows: the excerpts.
        spread: standard deviations of the torques (n,), zero where one does not vary.
    """
    joints = np.flatnonzero(spread > 0)
    stride = max(1, len(rows.q) // ROWS)
    thin = tuple(part.thinned(stride) for part in rows.excerpts)
    before = _cost(robot, thin, spread, joints, np.ones(robot.n))
    if before < np.log(WELL):
        return []
    best, found = before - BETTER, None
    for joint in range(robot.n):
        sign = np.ones(robot.n)
        sign[joint] = -1.0
        turned = tuple(replace(part, q=part.q * sign, dq=part.dq * sign, ddq=part.ddq * sign) for part in thin)
        for torque_sign in (np.ones(robot.n), sign):
            cost = _cost(robot, turned, spread, joints, torque_sign)
            if cost < best:
                best, found = cost, (joint, bool(torque_sign[joint] < 0))
    if found is None:
        return []
    joint, with_torque = found
    better = before - best
    smaller = 100 * float(1 - np.exp(-better))
    return [
        Finding(
            name="position_sign",
            severity="refuse" if better > CERTAIN else "warning",
            text=f"{robot.joint_names[joint]} seems to turn the other way than the robot's description says: with its "
            f"position{' and torque' if with_torque else ''} turned, errors are {smaller:.3g} % smaller",
            action="turn its sign in a mapping (`sign: -1`), or correct the description",
            value=smaller,
            unit="%",
            column=f"q{joint + 1}",
            joint=joint + 1,
        )
    ]


def _cost(robot: Robot, excerpts: tuple[Excerpt, ...], spread: Array, joints: NDArray[np.intp], sign: Array) -> float:
    moments = Rows.of(robot, excerpts).moments(joints, raw=True).scaled(sign)
    return float(np.mean(np.log(np.clip(fit_all(moments, spread).unexplained[joints], 1e-9, 1.0))))

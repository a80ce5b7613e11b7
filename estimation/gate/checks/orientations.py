"""A joint that turns the other way than the robot's description says."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from estimation.gate.finding import Finding
from estimation.gate.quick_fits.joint_fit import Rows
from estimation.gate.quick_fits.whole_fit import RIDGES, Moments, fit_all
from robots.robot import Robot

Array = NDArray[np.float64]

# Below this unexplained fraction of the torque, directions count as right.
WELL = 0.1
# Improvement (mean log error) with a joint's sign inverted, for a warning and for a refusal.
BETTER, CERTAIN = 0.2, 0.5
# Rows that are enough to see it, and rows and a ridge that rule most joints out: less than half of `BETTER` on those.
ROWS, FEW, RIDGE = 1500, 500, 1e-5


def check_orientations(robot: Robot, rows: Rows, spread: Array) -> list[Finding]:
    """Turns one joint after the other, with and without its torque, and sees whether the torques are explained better.

    Args:
        robot: with n joints.
        rows: the excerpts.
        spread: standard deviations of the torques (n,), zero where one does not vary.
    """
    joints = np.flatnonzero(spread > 0)

    def moments(sign: Array, most: int) -> Moments:
        thin = (part.thinned(max(1, len(rows.q) // most)) for part in rows.excerpts)
        turned = (replace(part, q=part.q * sign, dq=part.dq * sign, ddq=part.ddq * sign) for part in thin)
        return Rows.of(robot, tuple(turned)).moments(joints, raw=True)

    def cost(moments: Moments, ridges: Sequence[float] = RIDGES) -> float:
        unexplained = fit_all(moments, spread, ridges).unexplained[joints]
        return float(np.mean(np.log(np.clip(unexplained, 1e-9, 1.0))))

    straight = np.ones(robot.n)
    before = cost(moments(straight, ROWS))
    if before < np.log(WELL):
        return []
    enough = cost(moments(straight, FEW), (RIDGE,)) - BETTER / 2
    best, found = before - BETTER, None
    for joint in range(robot.n):
        sign = np.ones(robot.n)
        sign[joint] = -1.0
        some = moments(sign, FEW)
        if min(cost(some.scaled(torque_sign), (RIDGE,)) for torque_sign in (straight, sign)) > enough:
            continue
        turned = moments(sign, ROWS)
        for torque_sign in (straight, sign):
            after = cost(turned.scaled(torque_sign))
            if after < best:
                best, found = after, (joint, bool(torque_sign[joint] < 0))
    if found is None:
        return []
    joint, with_torque = found
    better = before - best
    smaller = 100 * float(1 - np.exp(-better))
    return [
        Finding(
            name="position_sign",
            severity="refuse" if better > CERTAIN else "warning",
            text=f"{robot.joint_names[joint]} seems to turn opposite to the robot's description: with opposite sign "
            f"of its "
            f"position{' and torque' if with_torque else ''} errors are {smaller:.3g} % smaller",
            action="set `sign: -1` for it in a mapping (--mapping), or correct the description",
            value=smaller,
            unit="%",
            column=f"q{joint + 1}",
            joint=joint + 1,
        )
    ]

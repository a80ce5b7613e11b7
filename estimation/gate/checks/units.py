"""Positions in another unit, or of the motor instead of the link."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimation.gate.columns import Columns
from estimation.gate.finding import Finding
from robots.robot import Robot

Array = NDArray[np.float64]

# A joint has left its range where it passes a limit by more than this share of it: URDF limits are soft in practice.
BEYOND = 0.25
# Without limits: more turns than this either way are no motion of an arm's joint.
TURNS = 8.0
# Share of the moving joints that must agree before a unit is named.
AGREE = 0.5
# Beyond so many times the range, no zero and no description is that wrong.
ABSURD = 8.0


@dataclass(frozen=True, eq=False)
class Suspicion:
    """Another unit that the positions may be in.

    Attributes:
        factor: by which to divide them (n,).
        finding: what to say if that is right.
        certain: whether the range alone proves it.
    """

    factor: Array
    finding: Finding
    certain: bool


def suspect_position_unit(robot: Robot, columns: Columns) -> Suspicion | None:
    """Finds the unit that would bring positions beyond the joints' limits inside.

    Args:
        robot: with n joints.
        columns: of the log.
    """
    beyond = beyond_limits(robot, columns)
    moving = columns.travel > 0
    if (beyond & moving).sum() < AGREE * max(int(moving.sum()), 1):
        return None
    revolute = np.array([joint.kind == "revolute" for joint in robot.chain.joints])
    candidates = {
        "unit_of_position": (np.where(revolute, 180.0 / np.pi, 1000.0), "in degrees (or millimetres)", "unit"),
        "motor_side_position": (np.abs(np.asarray(robot.gear_ratio)), "of the motors, not the links", "gear ratios"),
    }
    for name, (factor, words, what) in candidates.items():
        # All joints come in one unit; those that move little stay inside their limits in any.
        if np.allclose(factor[beyond], 1.0) or beyond_limits(robot, columns, factor).any():
            continue
        extremes = np.array([columns.extreme(joint) for joint in range(robot.n)])
        worst = int(np.argmax(np.where(beyond, np.abs(extremes), 0.0)))
        extreme = float(extremes[worst])
        return Suspicion(
            np.asarray(factor, dtype=float),
            Finding(
                name=name,
                severity="refuse",
                text=(
                    f"reaches {extreme:.4g}, and {int(beyond.sum())} of {robot.n} joints exceed their range: "
                    f"positions seem to be {words}"
                ),
                action=f"set the {what} in the file's head or in a mapping (--mapping)",
                value=abs(extreme),
                unit="rad or m",
                column=f"q{worst + 1}",
                joint=worst + 1,
            ),
            bool(abs(extreme) > ABSURD * _range(robot, worst)),
        )
    return None


def beyond_limits(robot: Robot, columns: Columns, factor: Array | float = 1.0) -> NDArray[np.bool_]:
    """Which joints (n,) leave their range by far, their positions divided by a factor (n,)."""
    bounds = zip(columns.lowest / factor, columns.highest / factor, strict=True)
    return np.array([_outside(robot, float(low), float(high), joint) for joint, (low, high) in enumerate(bounds)])


def beyond_findings(robot: Robot, columns: Columns) -> list[Finding]:
    """Names the joints that leave their range."""
    return [
        _left(robot, columns.extreme(int(joint)), int(joint)) for joint in np.flatnonzero(beyond_limits(robot, columns))
    ]


def _left(robot: Robot, extreme: float, joint: int) -> Finding:
    return Finding(
        name="beyond_limits",
        severity="warning",
        text=f"reaches {extreme:.4g}, the robot's description allows {robot.limits.lower[joint]:.4g} to "
        f"{robot.limits.upper[joint]:.4g}",
        action="check its zero, sign and unit, and that the log belongs to this robot",
        value=extreme,
        unit="rad or m",
        column=f"q{joint + 1}",
        joint=joint + 1,
    )


def _outside(robot: Robot, low: float, high: float, joint: int) -> bool:
    lower, upper = float(robot.limits.lower[joint]), float(robot.limits.upper[joint])
    if not np.isfinite(lower) or not np.isfinite(upper):
        return max(-low, high) > TURNS * 2 * np.pi
    # A limit of zero width on one side still allows a share of the whole range.
    slack = BEYOND * max(upper - lower, 1e-9)
    return low < lower - slack or high > upper + slack


def _range(robot: Robot, joint: int) -> float:
    width = float(robot.limits.upper[joint] - robot.limits.lower[joint])
    return width if np.isfinite(width) else 4 * np.pi


def check_speed(robot: Robot, peak: Array) -> list[Finding]:
    """Finds joints faster than they can be: a clock that is too fast, or a unit that is too small.

    Args:
        robot: with n joints.
        peak: largest smoothed speed of each joint (n,) [rad/s or m/s].
    """
    limit = np.asarray(robot.limits.velocity)
    known = np.isfinite(limit) & (limit > 0)
    if not known.any():
        return []
    ratio = np.where(known, peak / np.where(known, limit, 1.0), 0.0)
    worst = int(np.argmax(ratio))
    if ratio[worst] < 2.0:
        return []
    return [
        Finding(
            name="too_fast",
            severity="warning",
            text=f"reaches a speed of {peak[worst]:.3g}, {ratio[worst]:.3g} times the limit in the robot's description",
            action="check the units of t and q, and that the log belongs to this robot",
            value=float(peak[worst]),
            unit="rad/s or m/s",
            column=f"q{worst + 1}",
            joint=worst + 1,
        )
    ]

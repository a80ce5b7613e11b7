"""Positions beyond the joints' limits: in another unit, of the motors, or just beyond."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from estimation.gate.check import Check
from estimation.gate.context import Context, Stage
from estimation.gate.finding import Finding
from estimation.gate.measurements.columns import Columns
from robots.robot import Robot

Array = NDArray[np.float64]

# A joint is beyond a limit by more than this share of its range: limits of a URDF are often not exact.
BEYOND = 0.25
# Turns from zero above which a revolute joint without limits is beyond its range.
TURNS = 8.0
# Share of the moving joints that must be beyond their limits before another unit is considered.
AGREE = 0.5
# So many ranges from zero, a position is certainly in another unit: no error of zero or limits is that large.
CERTAIN = 8.0
# Decrease of the held-out torque error (mean log) with the other unit, from which it is accepted otherwise.
BETTER = 0.1


class PositionUnits(Check):
    """Refuses positions in another unit. Reports joints beyond their limits if no other unit explains them."""

    name: ClassVar[str] = "position_units"
    stage: ClassVar[Stage] = Stage.SMOOTHED
    order: ClassVar[int] = 10

    def run(self, context: Context) -> list[Finding]:
        """Compares positions with the limits, and the fits with both units."""
        robot, columns = context.robot, context.cleaned.columns
        suspicion = _suspect(robot, columns)
        if suspicion is not None and (suspicion.certain or _fits_better(context, suspicion.factor)):
            return [suspicion.finding]
        return [
            _single(robot, columns, int(j)) or _beyond_finding(robot, columns.extreme(int(j)), int(j))
            for j in np.flatnonzero(_beyond(robot, columns))
        ]


@dataclass(frozen=True, eq=False)
class _Suspicion:
    """Another unit that the positions may be in.

    Attributes:
        factor: by which to divide them (n,).
        finding: if that unit is right.
        certain: whether the positions alone prove it.
    """

    factor: Array
    finding: Finding
    certain: bool


def _suspect(robot: Robot, columns: Columns) -> _Suspicion | None:
    """Finds the unit that brings all positions inside the joints' limits."""
    beyond = _beyond(robot, columns)
    moving = columns.travel > 0
    found, whole = int((beyond & moving).sum()), max(int(moving.sum()), 1)
    if found < AGREE * whole or (whole == 2 and found < whole):
        return None
    revolute = np.array([joint.kind == "revolute" for joint in robot.chain.joints])
    candidates = {
        "unit_of_position": (np.where(revolute, 180.0 / np.pi, 1000.0), "in degrees (or millimetres)", "unit"),
        "motor_side_position": (np.abs(np.asarray(robot.gear_ratio)), "of the motors, not the links", "gear ratios"),
    }
    for name, (factor, words, what) in candidates.items():
        # All joints have the same unit; those that move little stay inside their limits in any unit.
        if np.allclose(factor[beyond], 1.0) or _beyond(robot, columns, factor).any():
            continue
        extremes = np.array([columns.extreme(joint) for joint in range(robot.n)])
        worst = int(np.argmax(np.where(beyond, np.abs(extremes), 0.0)))
        extreme = float(extremes[worst])
        finding = Finding(
            name=name,
            severity="refuse",
            text=f"reaches {extreme:.4g}, and {int(beyond.sum())} of {robot.n} joints exceed their range: "
            f"positions seem to be {words}",
            action=f"set the {what} in the file's head or in a mapping (--mapping)",
            value=abs(extreme),
            unit="rad or m",
            column=f"q{worst + 1}",
            joint=worst + 1,
        )
        return _Suspicion(np.asarray(factor, dtype=float), finding, abs(extreme) > CERTAIN * _range(robot, worst))
    return None


def _single(robot: Robot, columns: Columns, joint: int) -> Finding | None:
    """Gives the finding of a single joint in degrees or millimetres, if it is too far from zero for anything else."""
    extreme = columns.extreme(joint)
    revolute = robot.chain.kinds[joint] == "revolute"
    factors = np.ones(robot.n)
    factors[joint] = np.pi / 180 if revolute else 1e-3
    if abs(extreme) < CERTAIN * _range(robot, joint) or _beyond(robot, columns, 1 / factors)[joint]:
        return None
    scale, unit = ", ".join(f"{factor:.5g}" for factor in factors), "degrees" if revolute else "millimetres"
    return Finding(
        name="unit_of_position",
        severity="refuse",
        text=f"reaches {extreme:.4g}: only this joint's position seems to be in {unit}",
        action=f"state `scale: [{scale}]` for the position in a mapping (--mapping)",
        value=abs(extreme),
        unit="rad or m",
        column=f"q{joint + 1}",
        joint=joint + 1,
    )


def _fits_better(context: Context, factor: Array) -> bool:
    """Whether torques fit better with the positions divided by a factor (n,)."""
    smoothed = context.smoothed
    if smoothed.rows is None:
        return False
    other = smoothed.error_with_positions(context.cleaned.log.q / factor)
    return other < smoothed.choice.cost - BETTER


def _beyond(robot: Robot, columns: Columns, factor: Array | float = 1.0) -> NDArray[np.bool_]:
    """Finds the joints (n,) that are beyond their limits with positions divided by a factor (n,)."""
    bounds = zip(columns.lowest / factor, columns.highest / factor, strict=True)
    return np.array([_is_beyond(robot, float(low), float(high), joint) for joint, (low, high) in enumerate(bounds)])


def _is_beyond(robot: Robot, low: float, high: float, joint: int) -> bool:
    lower, upper = float(robot.limits.lower[joint]), float(robot.limits.upper[joint])
    if not np.isfinite(lower) or not np.isfinite(upper):
        return max(-low, high) > TURNS * 2 * np.pi
    slack = BEYOND * max(upper - lower, 1e-9)
    return low < lower - slack or high > upper + slack


def _range(robot: Robot, joint: int) -> float:
    width = float(robot.limits.upper[joint] - robot.limits.lower[joint])
    return width if np.isfinite(width) else 4 * np.pi


def _beyond_finding(robot: Robot, extreme: float, joint: int) -> Finding:
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

"""Positions beyond the joints' limits: in another unit, of the motors, or just beyond."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimation.gate.context import Context
from estimation.gate.finding import Finding
from estimation.recordings.rows.columns import Columns
from estimation.recordings.rows.motion import beyond_limits
from robots.common.arrays import Array
from robots.robot import Robot

# Share of the moving joints that must be beyond their limits before another unit is considered.
AGREE = 0.5
# So many ranges from zero, a position is certainly in another unit: no error of zero or limits is that large.
CERTAIN = 8.0
# Decrease of the held-out torque error (mean log) with the other unit, from which it is accepted otherwise.
BETTER = 0.1
# Positions in percent of a range stay below this.
FULL = 101.0


def position_units(context: Context) -> list[Finding]:
    """Refuses positions in another unit. Reports joints beyond their limits if no other unit explains them."""
    robot, columns = context.robot, context.recorded.columns
    beyond = beyond_limits(robot, columns.extremes)
    moving = columns.travel > 0
    found, whole = int((beyond & moving).sum()), max(int(moving.sum()), 1)
    if found >= AGREE * whole and (whole != 2 or found == whole):
        units = [unit for unit in _units(robot, columns) if not unit.beyond(robot, columns).any()]
        if not units and beyond.any() and all(_is_whole(q) for q in columns.q[moving]):
            units = [COUNTS]
        if units and (chosen := _chosen(context, units)) is not None:
            return [_finding(robot, columns, beyond, chosen)]
    return [
        _single(robot, columns, int(j)) or _beyond_finding(robot, columns.extreme(int(j)), int(j))
        for j in np.flatnonzero(beyond)
    ]


@dataclass(frozen=True, eq=False)
class _Unit:
    """A unit that the positions may be in: joint positions are ``q * scale + offset``.

    Attributes:
        name: of the finding.
        words: for it.
        remedy: what to state.
        scale: (n,), or a number.
        offset: (n,), or a number [rad or m].
    """

    name: str
    words: str
    remedy: str
    scale: Array | float = 1.0
    offset: Array | float = 0.0

    def beyond(self, robot: Robot, columns: Columns) -> NDArray[np.bool_]:
        """Finds the joints (n,) that are beyond their limits in this unit."""
        return beyond_limits(robot, columns.extremes * self.scale + self.offset)


COUNTS = _Unit(
    "unit_of_position",
    "counts of an encoder",
    "state for the position unit: turn and side: motor, with gear_ratio: counts a turn of each joint, in a mapping "
    "(--mapping)",
)


def _units(robot: Robot, columns: Columns) -> list[_Unit]:
    """Lists the units in which positions may be logged: all joints have the same one."""
    revolute = np.array([joint.kind == "revolute" for joint in robot.chain.joints])
    names = ["deg" if turns else "mm" for turns in revolute]
    stated = "deg" if revolute.all() else f"[{', '.join(names)}]"
    units = [
        _Unit(
            "unit_of_position",
            "in degrees" if revolute.all() else "in degrees (or millimetres)",
            f"state `position: {{unit: {stated}}}` in a mapping (--mapping)",
            np.where(revolute, np.pi / 180.0, 1e-3),
        )
    ]
    gears = np.abs(np.asarray(robot.gear_ratio, dtype=float))
    if not np.allclose(gears, 1.0):
        words = "of the motors, not the links"
        ratios = ", ".join(f"{ratio:g}" for ratio in np.asarray(robot.gear_ratio, dtype=float))
        motors = f"state `position: {{side: motor}}` and `gear_ratio: [{ratios}]` in a mapping (--mapping)"
        units.append(
            _Unit(
                "motor_side_position",
                words,
                motors,
                1.0 / gears,
            )
        )
    lower, upper = (np.asarray(bound, dtype=float) for bound in (robot.limits.lower, robot.limits.upper))
    shares = np.concatenate([columns.lowest, columns.highest])
    if np.isfinite(upper - lower).all() and np.abs(shares).max() < FULL:
        scale, offset = (upper - lower) / 200.0, (upper + lower) / 2.0
        listed = [", ".join(f"{value:.5g}" for value in values) for values in (scale, offset)]
        remedy = f"state `scale: [{listed[0]}]` and `offset: [{listed[1]}]` for the position in a mapping (--mapping)"
        units.append(_Unit("unit_of_position", "percent of each joint's range, -100 to 100", remedy, scale, offset))
    return units


def _is_whole(q: Array) -> bool:
    return bool(np.all(q == np.round(q)))


def _chosen(context: Context, units: list[_Unit]) -> _Unit | None:
    """Gives the unit with which the torques fit best; the first one where the positions alone prove another unit."""
    columns = context.recorded.columns
    ranges = [_range(context.robot, joint) for joint in range(context.robot.n)]
    certain = any(abs(columns.extreme(joint)) > CERTAIN * width for joint, width in enumerate(ranges))
    if (len(units) == 1 and certain) or not context.can_be_fitted:
        return units[0] if certain else None
    q = context.cleaned.log.q
    errors = [context.smoothed.error_with_positions(q * unit.scale + unit.offset) for unit in units]
    best = int(np.argmin(errors))
    return units[best] if certain or errors[best] < context.smoothed.choice.cost - BETTER else None


def _finding(robot: Robot, columns: Columns, beyond: NDArray[np.bool_], unit: _Unit) -> Finding:
    extremes = np.array([columns.extreme(joint) for joint in range(robot.n)])
    worst = int(np.argmax(np.where(beyond, np.abs(extremes), 0.0)))
    return Finding(
        name=unit.name,
        severity="refuse",
        text=f"reaches {extremes[worst]:.4g}, and {int(beyond.sum())} of {robot.n} joints exceed their range: "
        f"positions seem to be {unit.words}",
        action=unit.remedy,
        value=abs(float(extremes[worst])),
        unit="rad or m",
        column=f"q{worst + 1}",
        joint=worst + 1,
    )


def _single(robot: Robot, columns: Columns, joint: int) -> Finding | None:
    """Gives the finding of a single joint in degrees or millimetres, if it is too far from zero for anything else."""
    extreme = columns.extreme(joint)
    revolute = robot.chain.kinds[joint] == "revolute"
    factors = np.ones(robot.n)
    factors[joint] = np.pi / 180 if revolute else 1e-3
    inside = not beyond_limits(robot, columns.extremes * factors)[joint]
    if abs(extreme) < CERTAIN * _range(robot, joint) or not inside:
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

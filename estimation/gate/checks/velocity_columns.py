"""Velocity columns against the derivative of the position."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from estimation.gate.context import Context
from estimation.gate.finding import Finding
from robots.common.arrays import Array
from robots.robot import Robot

# A column disagrees with the derivative below this correlation, ...
LIKE = 0.9
# ... or if its size differs by more than this share.
SIZE = 0.1
# Share by which a ratio may differ from the factor of a unit.
NEAR = 0.06
# RMS speed [rad/s or m/s] below which a joint stands.
STILL = 1e-6
DEGREES = 180.0 / np.pi


def velocity_columns(context: Context) -> list[Finding]:
    """Compares each velocity column with the derivative of its position: unit, sign, size and shape."""
    excerpts = context.smoothed.excerpts
    if not excerpts or excerpts[0].column is None:
        return []
    numeric = np.concatenate([part.dq for part in excerpts])
    column = np.concatenate([part.column for part in excerpts if part.column is not None])
    energy, product, own = (np.sum(x, axis=0) for x in (numeric**2, numeric * column, column**2))
    moves = np.sqrt(energy / len(numeric)) > STILL
    correlation = np.where(moves & (own > 0), product / np.sqrt(np.maximum(energy * own, 1e-300)), np.nan)
    size = np.where(moves, product / np.maximum(energy, 1e-300), np.nan)
    common = _common_factor(context.robot, correlation, size, moves)
    if common is not None:
        return [common]
    faults = {int(j): _fault(float(correlation[j]), float(size[j])) for j in np.flatnonzero(moves)}
    return [
        Finding(
            name="velocity_column",
            severity="warning",
            text=text,
            action="velocities are computed from the positions; check which of the two columns is right",
            value=float(size[joint]),
            column=f"dq{joint + 1}",
            joint=joint + 1,
        )
        for joint, text in faults.items()
        if text is not None
    ]


def _fault(correlation: float, size: float) -> str | None:
    if np.isnan(correlation):
        return "is zero although the position changes"
    if correlation < -LIKE:
        return f"has the opposite sign of the position's derivative (correlation {correlation:.2f})"
    if abs(correlation) < LIKE:
        return f"does not match the position's derivative (correlation {correlation:.2f})"
    if abs(size - 1.0) > SIZE:
        return f"is {size:.4g} times the derivative of the position"
    return None


def _common_factor(robot: Robot, correlation: Array, size: Array, moves: NDArray[np.bool_]) -> Finding | None:
    """Names the wrong unit, if a factor is common to all joints."""
    sure = moves & (correlation > LIKE)
    if not sure.any():
        return None
    revolute = np.array([joint.kind == "revolute" for joint in robot.chain.joints])
    gears = np.abs(np.asarray(robot.gear_ratio, dtype=float))

    def has_factor(factor: Array | float, which: NDArray[np.bool_]) -> bool:
        ratio = size / factor
        return bool(which.any() and np.all(np.abs(ratio[which] - 1.0) < NEAR))

    turning, sliding, geared = sure & revolute, sure & ~revolute, sure & (gears > 2)
    if has_factor(1.0 / DEGREES, turning):
        return _refusal("unit_of_position", size, turning, "positions seem to be in degrees", "q")
    if has_factor(1000.0, sure):
        return _refusal("unit_of_time", size, sure, "the time seems to be in milliseconds", "t")
    if has_factor(1e-3, sliding):
        return _refusal("unit_of_position", size, sliding, "positions seem to be in millimetres", "q")
    if has_factor(1.0 / gears, geared):
        return _refusal("motor_side_position", size, geared, "positions seem to be motor positions", "q")
    if has_factor(DEGREES, turning):
        return Finding(
            name="velocity_column",
            severity="warning",
            text=f"velocities are {DEGREES:.3g} times the derivative of the positions: probably in degrees per second",
            action="velocities are computed from the positions and these columns ignored; set their unit",
            value=float(np.nanmedian(size[turning])),
            column=f"dq{int(np.argmax(turning)) + 1}",
        )
    return None


def _refusal(name: str, size: Array, which: NDArray[np.bool_], text: str, prefix: str) -> Finding:
    joint = int(np.argmax(which))
    ratio = float(np.median(size[which]))
    return Finding(
        name=name,
        severity="refuse",
        text=f"velocities are {ratio:.4g} times the derivative of the positions: {text}",
        action=f"set the unit of {prefix} in the file's head or in a mapping (--mapping)",
        value=ratio,
        column=prefix if prefix == "t" else f"{prefix}{joint + 1}",
    )

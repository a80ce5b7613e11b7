"""Velocity columns against the derivative of the position."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from estimation.gate.finding import Finding
from estimation.gate.quick_fits.excerpts import Excerpt
from robots.robot import Robot

Array = NDArray[np.float64]

# A column disagrees when it explains less than this share of the derivative's energy, ...
LIKE = 0.9
# ... or when its size is off by more than this.
SIZE = 0.1
# Width of a unit's factor: 57.3 is meant where 54 to 61 is found.
NEAR = 0.06
# Below this speed [rad/s or m/s] a joint stands.
STILL = 1e-6


def check_velocities(robot: Robot, excerpts: tuple[Excerpt, ...]) -> list[Finding]:
    """Compares each velocity column with the derivative of its position: unit, sign, lag and likeness.

    Args:
        robot: with n joints.
        excerpts: of the log.
    """
    if not excerpts or excerpts[0].column is None:
        return []
    numeric = np.concatenate([part.dq for part in excerpts])
    column = np.concatenate([part.column for part in excerpts if part.column is not None])
    energy, product, own = (np.sum(x, axis=0) for x in (numeric**2, numeric * column, column**2))
    moves = np.sqrt(energy / len(numeric)) > STILL
    likeness = np.where(moves & (own > 0), product / np.sqrt(np.maximum(energy * own, 1e-300)), np.nan)
    size = np.where(moves, product / np.maximum(energy, 1e-300), np.nan)
    common = _common_factor(robot, likeness, size, moves)
    if common is not None:
        return [common]
    findings = []
    for joint in np.flatnonzero(moves):
        text = _fault(float(likeness[joint]), float(size[joint]))
        if text is None:
            continue
        findings.append(
            Finding(
                name="velocity_column",
                severity="warning",
                text=text,
                action="velocities are computed from the positions; check which of the two columns is right",
                value=float(size[joint]),
                column=f"dq{joint + 1}",
                joint=int(joint) + 1,
            )
        )
    return findings


def _fault(likeness: float, size: float) -> str | None:
    if np.isnan(likeness):
        return "is zero although the position changes"
    if likeness < -LIKE:
        return f"has the opposite sign of the position's derivative (correlation {likeness:.2f})"
    if abs(likeness) < LIKE:
        return f"does not match the position's derivative (correlation {likeness:.2f})"
    if abs(size - 1.0) > SIZE:
        return f"is {size:.4g} times the derivative of the position"
    return None


def _common_factor(robot: Robot, likeness: Array, size: Array, moves: NDArray[np.bool_]) -> Finding | None:
    """A common factor of all joints identifies the wrong unit."""
    sure = moves & (likeness > LIKE)
    if not sure.any():
        return None
    revolute = np.array([joint.kind == "revolute" for joint in robot.chain.joints])
    gears = np.abs(np.asarray(robot.gear_ratio, dtype=float))
    degree = 180.0 / np.pi

    def meant(factor: Array | float, which: NDArray[np.bool_]) -> bool:
        ratio = size / factor
        return bool(which.any() and np.all(np.abs(ratio[which] - 1.0) < NEAR))

    turning = sure & revolute
    if meant(1.0 / degree, turning):
        return _refusal("unit_of_position", size, turning, "positions seem to be in degrees", "q")
    if meant(1000.0, sure):
        return _refusal("unit_of_time", size, sure, "the time seems to be in milliseconds", "t")
    if meant(1e-3, sure & ~revolute):
        return _refusal("unit_of_position", size, sure & ~revolute, "positions seem to be in millimetres", "q")
    if meant(1.0 / gears, sure & (gears > 2)):
        return _refusal("motor_side_position", size, sure & (gears > 2), "positions seem to be motor positions", "q")
    if meant(degree, turning):
        return Finding(
            name="velocity_column",
            severity="warning",
            text=f"velocities are {degree:.3g} times the derivative of the positions: probably in degrees per second",
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

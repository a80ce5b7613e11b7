"""What was read of a robot: its chain, limits, masses, and what is assumed, as text and as plain data."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from robots.common.arrays import Array
from robots.common.plain import finite
from robots.geometry.inertia import symmetric
from robots.limits import ACCELERATION_PER_VELOCITY, BOUNDS, JERK_PER_ACCELERATION
from robots.robot import Robot


def robot_data(robot: Robot) -> dict[str, Any]:
    """Writes a robot as plain data: SI units, joints from 1, null where something is unknown or unlimited.

    Args:
        robot: the robot.
    """
    poses = robot.chain.transforms(np.zeros(robot.n))
    joints, links = [], []
    for i, joint in enumerate(robot.chain.joints):
        limits = robot.limits
        joints.append(
            {
                "joint": i + 1,
                "name": joint.name,
                "kind": joint.kind,
                "units": {"position": limits.unit(i), "torque": limits.unit(i, "torque")},
                "origin": poses[i, :3, 3].tolist(),
                "axis": (poses[i, :3, :3] @ joint.axis).tolist(),
                "limits": {name: finite(float(getattr(limits, name)[i])) for name in BOUNDS},
                "friction": robot.friction[i].tolist(),
                "rotor_inertia": float(robot.rotor_inertia[i]),
                "gear_ratio": float(robot.gear_ratio[i]),
                "torque_constant": finite(float(robot.torque_constant[i])),
            }
        )
        links.append({"link": i + 1, **_body(robot.inertia[i])})
    masses = robot.inertia[:, 0]
    return {
        "name": robot.name,
        "title": robot.title,
        "origin": robot.origin,
        "sha256": robot.digest,
        "gravity": robot.chain.gravity.tolist(),
        "period": robot.period,
        "payload": robot.payload,
        "reach": reach(robot),
        "moved_mass": float(masses.sum()) if np.isfinite(masses).all() else None,
        "flange": robot.chain.flange(np.zeros(robot.n)).tolist(),
        "joints": joints,
        "links": links,
        "assumed": list(robot.assumed),
        "notes": list(robot.notes),
    }


def _body(parameters: Array) -> dict[str, Any]:
    """Mass, centre of mass and inertia about it, in the frame of the joint that moves the link."""
    mass = float(parameters[0])
    if not np.isfinite(parameters).all():
        return {"mass": None, "com": None, "inertia_at_com": None, "principal_moments": None}
    centre = parameters[1:4] / mass if mass else np.zeros(3)
    about = symmetric(parameters[4:]) - mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
    return {
        "mass": mass,
        "com": centre.tolist(),
        "inertia_at_com": about[np.triu_indices(3)].tolist(),
        "principal_moments": np.linalg.eigvalsh(about).tolist(),
    }


def reach(robot: Robot) -> float:
    """Adds up the lengths from the first joint to the flange [m]; prismatic joints count at zero."""
    lengths = [float(np.linalg.norm(joint.translation)) for joint in robot.chain.joints[1:]]
    return sum(lengths) + float(np.linalg.norm(robot.chain.tip[:3, 3]))


def robot_summary(robot: Robot) -> str:
    """Writes a robot as text: a table of joints, one of links, then what is assumed and what else to know.

    Args:
        robot: the robot.
    """
    data = robot_data(robot)
    mass = "unknown mass" if data["moved_mass"] is None else f"{data['moved_mass']:.4g} kg moved"
    gravity = ", ".join(f"{component:.4g}" for component in data["gravity"])
    title = f" ({robot.title})" if robot.title else ""
    lines = [
        f"{robot.name}{title}: {robot.n} joints, {mass}, reach {data['reach']:.3g} m",
        f"  gravity in the base frame: {gravity} m/s2; period of the controller: {1e3 * robot.period:g} ms",
    ]
    lines += _joint_table(robot)
    lines += _link_table(robot, data)
    assumed = [] if not robot.assumed else [f"values without a source: {', '.join(robot.assumed)}"]
    lines += [f"  note: {text}" for text in (*assumed, *robot.notes)]
    if any("*" in line for line in lines):
        lines.append(
            f"  * not stated; planned motions use full speed in {1 / ACCELERATION_PER_VELOCITY:g} s and full "
            f"acceleration in {1 / JERK_PER_ACCELERATION:g} s"
        )
    return "\n".join(lines)


def _joint_table(robot: Robot) -> list[str]:
    limits = robot.limits
    acceleration = np.where(
        np.isfinite(limits.acceleration), limits.acceleration, ACCELERATION_PER_VELOCITY * limits.velocity
    )
    jerk = np.where(np.isfinite(limits.jerk), limits.jerk, JERK_PER_ACCELERATION * acceleration)
    rows = [("joint", "kind", "position", "velocity", "acceleration", "jerk", "torque", "Coulomb", "viscous", "units")]
    for i, joint in enumerate(robot.chain.joints):
        length, force = limits.unit(i), limits.unit(i, "torque")
        ends = limits.lower[i], limits.upper[i]
        position = f"{ends[0]:.4g} to {ends[1]:.4g}" if np.isfinite(ends).any() else "unlimited"
        coulomb, viscous = robot.friction[i, :2]
        rows.append(
            (
                f"{i + 1} {joint.name}",
                joint.kind,
                position,
                _number(limits.velocity[i]),
                _number(acceleration[i]) + ("" if np.isfinite(limits.acceleration[i]) else "*"),
                _number(jerk[i]) + ("" if np.isfinite(limits.jerk[i]) else "*"),
                _number(limits.torque[i]),
                f"{coulomb:.3g}" if robot.friction[i].any() else "-",
                f"{viscous:.3g}" if robot.friction[i].any() else "-",
                f"{length}, s, {force}",
            )
        )
    return _aligned(rows, left={0, 1, 9})


def _link_table(robot: Robot, data: dict[str, Any]) -> list[str]:
    rows = [("link", "mass [kg]", "centre of mass [m]", "principal moments [kg m2]", "joint at zero pose [m]", "axis")]
    for joint, link in zip(data["joints"], data["links"], strict=True):
        known = link["mass"] is not None
        rows.append(
            (
                f"{link['link']} of {joint['name']}",
                f"{link['mass']:.4g}" if known else "unknown",
                _vector(link["com"]) if known else "unknown",
                _vector(link["principal_moments"]) if known else "unknown",
                _vector(joint["origin"]),
                _vector(joint["axis"]),
            )
        )
    return _aligned(rows, left={0})


def _number(value: float) -> str:
    return f"{value:.4g}" if np.isfinite(value) else "unlimited"


def _vector(values: list[float]) -> str:
    # A rotation by a rounded right angle leaves 1e-17, and a minus sign before a zero.
    return " ".join(f"{round(value, 9) + 0.0:.3g}" for value in values)


def _aligned(rows: Sequence[tuple[str, ...]], left: set[int]) -> list[str]:
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    return [
        "  "
        + "  ".join(
            cell.ljust(width) if column in left else cell.rjust(width)
            for column, (cell, width) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in rows
    ]

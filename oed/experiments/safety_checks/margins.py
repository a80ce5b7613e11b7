"""How far a motion stays from every limit, measured on its own samples."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robots.base_parameters import BaseParameters
from robots.common.arrays import Array
from robots.common.records import Finding, findings_of
from robots.limits import ACCELERATION_PER_VELOCITY, JERK_PER_ACCELERATION, Limits, Margin, symmetric_margins
from robots.plants import PlantEffect
from robots.robot import Robot
from robots.signals import Motion
from robots.terms.effects import situation

_SUBSTITUTES = {
    "acceleration": f"{ACCELERATION_PER_VELOCITY:g}/s times the velocity limit",
    "jerk": f"{JERK_PER_ACCELERATION:g}/s times the acceleration limit",
}


def missing_limits(limits: Limits) -> dict[str, tuple[int, ...]]:
    """Finds the quantities, and their joints from 1, for which cautious limits had to be assumed."""
    lacking = {name: np.flatnonzero(~np.isfinite(getattr(limits, name))) + 1 for name in ("acceleration", "jerk")}
    return {name: tuple(map(int, joints)) for name, joints in lacking.items() if joints.size}


def assumed_values(robot: Robot) -> list[str]:
    """Names what is assumed of a robot, such as ``limits.jerk``: values without a source, and limits not stated."""
    return list(dict.fromkeys([*robot.assumed, *(f"limits.{name}" for name in missing_limits(robot.limits))]))


def measured_margins(
    robot: Robot, motion: Motion, base: BaseParameters, effects: Sequence[PlantEffect] = ()
) -> tuple[Margin, ...]:
    """Measures the margins to all limits, the torque by the robot's nominal model where it is described.

    Args:
        robot: the robot.
        motion: what it does.
        base: whose model gives the torque.
        effects: what the robot has beyond its description.
    """
    limits: Limits = robot.limits
    margins = list(limits.margins(motion))
    limited = np.isfinite(limits.torque).any() or np.isfinite(limits.torque_rms).any()
    tau = nominal_torque(base, motion, effects) if limited else None
    if tau is not None and np.isfinite(limits.torque).any():
        margins += symmetric_margins("torque", motion.t, tau, limits.torque)
    if tau is not None and np.isfinite(limits.torque_rms).any():
        margins += _rms_margins(motion, tau, limits)
    if np.isfinite(robot.motor_speed).any():
        margins += symmetric_margins("motor speed", motion.t, robot.gear_ratio * motion.dq, robot.motor_speed)
    return tuple(margins)


def nominal_torque(base: BaseParameters, motion: Motion, effects: Sequence[PlantEffect] = ()) -> Array | None:
    """Computes the torque (N, n) [N m or N] that margins refer to; None where the robot's dynamics are not described.

    Args:
        base: whose model gives the torque.
        motion: what the robot does.
        effects: what the robot has beyond its description.
    """
    model = base.model
    if not model.described:
        return None
    if not effects:
        return model.torque(motion.q, motion.dq, motion.ddq, model.nominal)
    now = situation(model, model.nominal, motion.t, motion.q, motion.dq, motion.ddq)
    return np.sum([now.torque, *(effect.torque(now) for effect in effects)], axis=0)


def _rms_margins(motion: Motion, tau: Array, limits: Limits) -> list[Margin]:
    rms = np.sqrt(np.square(tau).mean(axis=0))
    return [
        Margin(
            quantity="torque RMS",
            joint=joint + 1,
            value=float(value),
            limit=float(limit),
            time=float(motion.t[-1]),
            slack_fraction=float(1 - value / limit) if limit > 0 else -np.inf,
        )
        for joint, (value, limit) in enumerate(zip(rms, limits.torque_rms, strict=True))
    ]


def assumption_findings(robot: Robot) -> tuple[Finding, ...]:
    """Lists what a plan assumes of its robot.

    Args:
        robot: whose motions are planned.
    """
    values = [f"Assumed values without a source: {', '.join(robot.assumed)}."] if robot.assumed else []
    limits = [
        f"The robot's description states no {name} limit for joint {', '.join(map(str, joints))}; assumed: "
        f"{_SUBSTITUTES[name]}."
        for name, joints in missing_limits(robot.limits).items()
    ]
    return (*findings_of("value.assumed", values), *findings_of("limit.assumed", limits))

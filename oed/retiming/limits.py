"""Finite limits for planners, where a robot's description is silent, and how much of them a motion uses."""

from __future__ import annotations

import dataclasses

import numpy as np

from robots.common.arrays import Array
from robots.common.errors import InfeasibleError, InputError
from robots.limits import ACCELERATION_PER_VELOCITY, JERK_PER_ACCELERATION, Limits, finite_jerk
from robots.signals import Motion


def finite_limits(limits: Limits) -> Limits:
    """Replaces infinite acceleration and jerk limits by cautious finite ones.

    acceleration = 4/s velocity, jerk = 20/s acceleration; finite limits stay as they are.

    Args:
        limits: bounds of all joints.

    Returns:
        Bounds with finite velocity, acceleration and jerk.

    Raises:
        InputError: a joint without a velocity limit, for which no default can be safe.
        InfeasibleError: a velocity, acceleration or jerk limit of zero.
    """
    for name in ("velocity", "acceleration", "jerk"):
        stuck = getattr(limits, name) <= 0.0
        if np.any(stuck):
            raise InfeasibleError(
                f"its {name} limit is zero: it cannot move",
                joint=int(np.argmax(stuck)) + 1,
                allowed=f"a {name} limit above zero",
            )
    if not np.all(np.isfinite(limits.velocity)):
        raise InputError(
            "has no velocity limit",
            joint=int(np.argmin(np.isfinite(limits.velocity))) + 1,
            remedy="state it: velocity of <limit> in a URDF (0 stands for unknown), or limits.velocity in a robot "
            "YAML, which may name a URDF or MJCF",
        )
    acceleration = np.where(
        np.isfinite(limits.acceleration), limits.acceleration, ACCELERATION_PER_VELOCITY * limits.velocity
    )
    jerk = np.where(np.isfinite(limits.jerk), limits.jerk, JERK_PER_ACCELERATION * acceleration)
    return dataclasses.replace(limits, acceleration=acceleration, jerk=jerk)


def limit_usage(motion: Motion, limits: Limits, torque: Array | None = None) -> dict[str, Array]:
    """Measures by a motion's own samples how much of each limit it uses.

    The jerk is the difference of the acceleration from sample to sample.

    Args:
        motion: N samples of n joints.
        limits: bounds; of an infinite one nothing is used.
        torque: joint torques of the motion, (N, n) [N m], if they are limited.

    Returns:
        Peak over limit of velocity, acceleration, jerk and, if given, torque, (n,) each; 1 is at the limit.
    """
    peaks = {
        "velocity": (_speed_usage(motion, limits), np.ones(motion.n)),
        "acceleration": (np.abs(motion.ddq).max(axis=0), limits.acceleration),
    }
    if len(motion) > 1:
        peaks["jerk"] = (np.abs(finite_jerk(motion)[1]).max(axis=0), limits.jerk)
    if torque is not None:
        peaks["torque"] = (np.abs(torque).max(axis=0), limits.torque)
    return {
        name: np.divide(peak, limit, out=np.where(peak > 0.0, np.inf, 0.0), where=limit > 0.0)
        for name, (peak, limit) in peaks.items()
    }


def _speed_usage(motion: Motion, limits: Limits) -> Array:
    """Peak of the speed over its limit, of each joint (n,)."""
    speed, limit = np.abs(motion.dq), np.broadcast_to(limits.speed_limit(motion.q, motion.dq), motion.dq.shape)
    return np.divide(speed, limit, out=np.where(speed > 0.0, np.inf, 0.0), where=limit > 0.0).max(axis=0)


def require_inside(q: Array, limits: Limits, tolerance: float = 1e-9, remedy: str | None = None) -> None:
    """Rejects positions outside the limits.

    Args:
        q: positions, (N, n) [rad].
        limits: bounds of all joints.
        tolerance: what counts as rounding [rad].
        remedy: for the message.

    Raises:
        InfeasibleError: naming the joint, its value and its range.
    """
    outside = (q < limits.lower - tolerance) | (q > limits.upper + tolerance)
    if np.any(outside):
        row, column = np.argwhere(outside)[0]
        raise InfeasibleError(
            f"the position {q[row, column]:.6g} {limits.unit(int(column))} is outside its limits",
            joint=int(column) + 1,
            allowed=f"{limits.lower[column]:.4g} to {limits.upper[column]:.4g} {limits.unit(int(column))}",
            remedy=remedy,
        )


def too_weak_to_hold(held: Array, limit: Array, what: str, limits: Limits) -> InfeasibleError | None:
    """Names the joint that cannot hold the arm somewhere on a path; None where all can.

    Args:
        held: torque at rest on the path (M, n) [N m].
        limit: of the torque (n,) [N m].
        what: asks for that torque, in words with the verb.
        limits: of the joints, for their units.
    """
    ratio = np.abs(held) / np.maximum(limit, 1e-300)
    row, column = np.unravel_index(int(ratio.argmax()), ratio.shape)
    if ratio[row, column] <= 1.0:
        return None
    unit = limits.unit(int(column), "torque")
    return InfeasibleError(
        f"{what} {abs(held[row, column]):.3g} {unit} on the path",
        joint=int(column) + 1,
        allowed=f"{limit[column]:.4g} {unit}",
        remedy="choose a path with poses that the joint can hold, or correct the torque limit",
    )

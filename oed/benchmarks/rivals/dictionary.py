"""Generic columns for a residual, in groups that each have a name."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from oed.benchmarks.rivals.base_model import Motion

Array = NDArray[np.float64]

SLOW = (0.02, 0.06)
"""Velocities of exponentials that fade with speed, as fractions of the largest speed."""

HARMONICS = (1.0, 2.0)
"""Periods of a ripple per turn of the motor."""


def groups(motion: Motion, torque: Array, j: int, gear: float | None) -> Iterator[tuple[str, Array]]:
    """Lists groups of columns (N, k) for one joint's residual, each with the name of the effect that it stands for.

    Args:
        motion: the motion.
        torque: the base model's torque (N, n) [N m].
        j: the joint, from 0.
        gear: gear ratio of the joint, or None if unknown.
    """
    t, q, v = motion.t, motion.q[:, j], motion.v[:, j]
    tau, sign = torque[:, j], np.sign(v)
    period = float(np.median(np.diff(motion.t)))
    rate = np.gradient(tau, period)
    top = max(float(np.abs(v).max()), 1e-9)
    size = max(float(np.sqrt((tau**2).mean())), 1e-9)
    yield "stribeck", np.column_stack([np.exp(-np.abs(v) / (share * top)) * sign for share in SLOW])
    yield "asymmetric_friction", np.column_stack([np.abs(v), v**2])
    yield "load_dependent_friction", np.column_stack([np.abs(tau) * sign, np.abs(tau) * v])
    yield "position_dependent_friction", np.column_stack([np.sin(q) * sign, np.cos(q) * sign])
    yield "friction_change", np.column_stack([t * sign, t * v])
    yield "spring", np.column_stack([q, q**2, q**3, np.sin(2 * q), np.cos(2 * q)])
    yield "torque_scale", np.column_stack([tau * np.abs(tau), tau**3 / size])
    yield "offset", np.column_stack([t, t**2])
    yield "delay", rate[:, None]
    yield "elasticity", np.gradient(rate, period)[:, None]
    if gear is not None:
        angles = [k * gear * q for k in HARMONICS]
        yield "torque_ripple", np.column_stack([f(angle) for angle in angles for f in (np.sin, np.cos)])
    near = [k for k in (j - 1, j + 1) if 0 <= k < motion.q.shape[1]]
    coupled = [(motion.q[:, k], np.sign(motion.v[:, k]), motion.v[:, k], motion.a[:, k]) for k in near]
    yield "coupling", np.column_stack([column for columns in coupled for column in columns])

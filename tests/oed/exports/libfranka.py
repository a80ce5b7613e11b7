"""The rate limiter of libfranka, written from its published source: no code of the product.

Source: ``franka::limitRate`` of joint positions and its constants in libfranka, src/rate_limiting.cpp and
include/franka/rate_limiting.h: those up to version 0.9 for the Panda, later ones for the FR3.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

DT, EPS = 1e-3, 1e-3

PANDA_ACCELERATION = np.array([15, 7.5, 10, 12.5, 15, 20, 20]) - EPS
PANDA_JERK = np.array([7500, 3750, 5000, 6250, 7500, 10000, 10000]) - EPS
PANDA_VELOCITY = np.array([2.175] * 4 + [2.61] * 3) - EPS - 3 * DT * PANDA_ACCELERATION

FR3_ACCELERATION, FR3_JERK = np.full(7, 10 - EPS), np.full(7, 5000 - EPS)
FR3_VELOCITY = np.array([2.62, 2.62, 2.62, 2.62, 5.26, 4.18, 5.26])
FR3_OFFSET = np.array([0.30, 0.20, 0.20, 0.30, 0.35, 0.35, 0.35])
FR3_FACTOR = np.array([12.0, 5.17, 7.00, 8.00, 34.0, 11.0, 34.0])
FR3_UPPER = np.array([2.75010, 1.79180, 2.90650, -0.1458, 2.81010, 4.52050, 3.01960])
FR3_LOWER = np.array([2.750100, 1.791800, 2.906500, 3.048100, 2.810100, -0.54092, 3.019600])


def fr3_limits(q: Array) -> tuple[Array, Array]:
    """Velocity limits of the FR3 at a pose (7,): upward, then downward."""
    up = np.sqrt(np.maximum(0.0, FR3_FACTOR * (FR3_UPPER - q)))
    down = np.sqrt(np.maximum(0.0, FR3_FACTOR * (FR3_LOWER + q)))
    upper = np.minimum(FR3_VELOCITY, np.maximum(0.0, up - FR3_OFFSET)) - EPS
    lower = np.maximum(-FR3_VELOCITY, np.minimum(0.0, FR3_OFFSET - down)) + EPS
    return upper, lower


def panda_limits(q: Array) -> tuple[Array, Array]:
    """Velocity limits of the Panda, the same everywhere."""
    return PANDA_VELOCITY, -PANDA_VELOCITY


ROBOTS = {"panda": (panda_limits, PANDA_ACCELERATION, PANDA_JERK), "fr3": (fr3_limits, FR3_ACCELERATION, FR3_JERK)}


def limited(q: Array, robot: str) -> tuple[Array, Array]:
    """What the limiter makes of positions (N, 7) at 1 kHz that begin at rest, and the largest change of each sample.

    The limiter knows what it has commanded itself, as the robot's q_d, dq_d and ddq_d are.
    """
    limits, acceleration, jerk = ROBOTS[robot]
    made = np.empty_like(q)
    made[0] = q[0]
    last_velocity, last_acceleration = np.zeros(7), np.zeros(7)
    for k in range(1, len(q)):
        upper, lower = limits(made[k - 1])
        velocity = (q[k] - made[k - 1]) / DT
        commanded_jerk = ((velocity - last_velocity) / DT - last_acceleration) / DT
        commanded = last_acceleration + np.clip(commanded_jerk, -jerk, jerk) * DT
        most = np.minimum(jerk / acceleration * (upper - last_velocity), acceleration)
        least = np.maximum(jerk / acceleration * (lower - last_velocity), -acceleration)
        new = last_velocity + np.maximum(np.minimum(commanded, most), least) * DT
        made[k] = made[k - 1] + new * DT
        last_acceleration, last_velocity = (new - last_velocity) / DT, new
    return made, np.abs(made - q).max(axis=1)

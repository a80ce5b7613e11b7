"""Masses of a usual arm, by its size and rated payload: for robots whose description states none."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from robots.common.arrays import Array
from robots.geometry.chain import Chain
from robots.geometry.inertia import inertial_parameters
from robots.limits import Limits

# Mass of an arm [kg] = MASS payload^BY_PAYLOAD reach^BY_REACH: least squares over the data sheets of 27 arms of 2 to
# 210 kg payload and 0.5 to 2.7 m reach, which scatter about it by a factor of 1.8.
USUAL_MASS, PAYLOAD_EXPONENT, REACH_EXPONENT = 18.5, 0.49, 1.44


def usual_body(mass: float, end: ArrayLike, arm: float) -> Array:
    """Gives a plausible body: its mass in the middle of a link, spread in all directions.

    Args:
        mass: [kg].
        end: (3,) where the next joint is, in the link's frame [m].
        arm: length of the arm [m].

    Returns:
        (10,) inertial parameters about the link's frame.
    """
    end = np.asarray(end, dtype=np.float64)
    # Radius of gyration of a link about its centre: a fifth of its length and a twentieth of the arm's.
    spread = (0.2 * float(np.linalg.norm(end)) + 0.05 * arm) ** 2
    return inertial_parameters(mass, end / 2, 2.0 * mass * spread * np.eye(3), np.eye(4))


def usual_masses(chain: Chain, limits: Limits, payload: float) -> Array:
    """Gives the inertial parameters of a usual arm of a chain's size.

    Args:
        chain: whose links they are.
        limits: of its joints.
        payload: rated payload [kg].

    Returns:
        (n, 10) about the link frames.
    """
    ends = [joint.translation for joint in chain.joints[1:]] + [chain.tip[:3, 3]]
    lengths = np.array([float(np.linalg.norm(end)) for end in ends])
    arm = max(float(lengths.sum()), 0.1)
    # Of the usual mass, 80 % is behind the first joint.
    moved = 0.8 * USUAL_MASS * payload**PAYLOAD_EXPONENT * working_reach(chain, limits) ** REACH_EXPONENT
    # A joint weighs what its reach to the flange asks for, and its own motor: 15 % of what the first one weighs more.
    left = np.cumsum(lengths[::-1])[::-1] / arm + 0.15
    return np.array([usual_body(mass, end, arm) for mass, end in zip(moved * left / left.sum(), ends, strict=True)])


def working_reach(chain: Chain, limits: Limits) -> float:
    """Finds how far the flange gets from the first joint's axis, or from its origin if that joint slides [m].

    It looks at poses spread evenly over the ranges; open ends count as half a turn, or half a metre.

    Args:
        chain: of n joints.
        limits: of these joints.
    """
    open_end = np.where(np.array(chain.kinds) == "prismatic", 0.5, np.pi)
    lower = np.where(np.isfinite(limits.lower), limits.lower, np.minimum(limits.upper, open_end) - 2 * open_end)
    upper = np.where(np.isfinite(limits.upper), limits.upper, lower + 2 * open_end)
    q = np.random.default_rng(0).uniform(lower, upper, (2000, chain.n))
    first = chain.joints[0]
    away = chain.flange(q)[:, :3, 3] - first.translation
    if first.kind == "revolute":
        axis = first.rotation @ first.axis
        away = away - np.outer(away @ axis, axis)
    return max(float(np.linalg.norm(away, axis=1).max()), 0.1)

"""Rotor inertia of the first joints, which no log separates from the link inertia.

Only the link inertia loads the gear. An effect that depends on the gear's load can therefore determine the rotor
inertia, if the robot's description lacks it or is inaccurate.
"""

from __future__ import annotations

import numpy as np

from robots.common.arrays import Array
from robots.terms.effect_bases.base import Shape, Situation

KNOWN_ROTOR = 0.0
"""Additional rotor inertia of a known rotor: none."""
ROTOR = Shape("rotor_inertia", "kg m2", -np.inf, np.inf, "linear", (KNOWN_ROTOR,), default=KNOWN_ROTOR)
"""Rotor inertia in addition to the one that is fitted or described [kg m2 or kg]."""


def unknown_rotor(situation: Situation, joint: int) -> float:
    """Returns the largest possible inertia of an unknown rotor [kg m2 or kg]; zero if the rotor is known."""
    return 0.0 if situation.rotors[:, joint - 1].any() else max(_least_inertia(situation, joint), 0.0)


def rotor_bounds(situation: Situation, joint: int) -> tuple[float, float]:
    """Returns the range of the additional rotor inertia [kg m2 or kg].

    It is zero if the base model's fit determines the rotor, and narrow if the robot's description states it. The rotor
    inertia cannot be larger than the joint's least inertia.
    """
    described = float(situation.rotors[1, joint - 1])
    if described:
        # Relative error of a described rotor inertia: datasheets often leave out brakes, couplings and gear shafts.
        within = 0.3 * described
        return -within, max(min(within, _least_inertia(situation, joint) - described), 0.0)
    return KNOWN_ROTOR, unknown_rotor(situation, joint)


def rotor_grid(situation: Situation, joint: int) -> tuple[float, ...]:
    """Lists the additional rotor inertias of a scan: zero, and half of the largest one if the rotor is unknown."""
    most = unknown_rotor(situation, joint)
    return (KNOWN_ROTOR, 0.5 * most) if most else (KNOWN_ROTOR,)


def rotors_between(situation: Situation, joint: int) -> tuple[float, ...]:
    """Lists evenly spaced additional rotor inertias over their range; empty if the rotor is known exactly."""
    low, high = rotor_bounds(situation, joint)
    return tuple(float(rotor) for rotor in np.linspace(low, high, 9)) if low < high else ()


def is_sure(situation: Situation, joint: int) -> bool:
    """Returns whether the inertia of a joint's rotor is known exactly."""
    low, high = rotor_bounds(situation, joint)
    return low == high


def load_beside(situation: Situation, joint: int, rotor: float) -> Array:
    """Returns a joint's gear load (N,) [N m or N] without the torque that accelerates an additional rotor."""
    return np.asarray(situation.load[:, joint - 1] - rotor * situation.ddq[:, joint - 1])


def _least_inertia(situation: Situation, joint: int) -> float:
    j = joint - 1
    return situation.cached(("least inertia", j), lambda: float(situation.sensitivity("inertia")[:, j, j].min()))

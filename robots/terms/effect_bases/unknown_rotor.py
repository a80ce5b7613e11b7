"""Rotor inertia of the first joints, which no log separates from the link inertia, but which does not load the gear.

Where a robot's description does not say it, or says it as datasheets do, what gears do with their load may.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from robots.terms.effect_bases.base import Shape, Situation

Array = NDArray[np.float64]

KNOWN = 0.0
"""No rotor beside those that are known."""
ROTOR = Shape("rotor_inertia", "kg m2", -np.inf, np.inf, "linear", (KNOWN,), default=KNOWN)
"""Rotor inertia in addition to the base model's, fitted or described."""
DATASHEET = 0.3
"""Share of a described rotor by which it may differ: brakes, couplings and gears' own shafts are often left out."""
LOOKS = 9
"""Rotors of a look along all that are possible."""


def unknown_rotor(situation: Situation, joint: int) -> float:
    """Gives the most that the rotor of a joint may have of its inertia, zero where one is known."""
    return 0.0 if situation.rotors[:, joint - 1].any() else max(_least_inertia(situation, joint), 0.0)


def rotor_bounds(situation: Situation, joint: int) -> tuple[float, float]:
    """Gives the range of the additional rotor inertia: zero if a log determines it, small if it is described."""
    described = float(situation.rotors[1, joint - 1])
    if described:
        within = DATASHEET * described
        return -within, max(min(within, _least_inertia(situation, joint) - described), 0.0)
    return KNOWN, unknown_rotor(situation, joint)


def rotor_grid(situation: Situation, joint: int) -> tuple[float, ...]:
    """Lists what a scan tries: no other rotor, and where none is known half of the inertia."""
    most = unknown_rotor(situation, joint)
    return (KNOWN, 0.5 * most) if most else (KNOWN,)


def rotors_between(situation: Situation, joint: int) -> tuple[float, ...]:
    """Lists rotors from the least to the most that one may be, for a look along them; none for one that is sure."""
    low, high = rotor_bounds(situation, joint)
    return tuple(float(rotor) for rotor in np.linspace(low, high, LOOKS)) if low < high else ()


def is_sure(situation: Situation, joint: int) -> bool:
    """Tells whether a joint's rotor can be no other than the one that is known."""
    low, high = rotor_bounds(situation, joint)
    return low == high


def load_beside(situation: Situation, joint: int, rotor: float) -> Array:
    """Gives the torque (N,) that passes a joint's gear: without what turns a rotor beside the one that is known."""
    return np.asarray(situation.load[:, joint - 1] - rotor * situation.ddq[:, joint - 1])


def _least_inertia(situation: Situation, joint: int) -> float:
    j = joint - 1
    return situation.cached(("least inertia", j), lambda: float(situation.sensitivity("inertia")[:, j, j].min()))

"""What of an identified link is left for the body that its joint moves, beside bodies that keep their own inertia."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Set
from typing import TypeVar

import numpy as np

from estimation.exports.standard import REMEDY
from robots.common.arrays import Array
from robots.common.errors import InfeasibleError
from robots.consistency import normalised_eigenvalues

Key = TypeVar("Key", bound=Hashable)

SHARES = (1.0, 0.1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6)  # of bodies on locked joints, which cannot be without mass


def remainder(whole: Array, others: Mapping[Key, Array], fixed: Set[Key], joint: str) -> tuple[Array, set[Key], float]:
    """Takes the other bodies off an identified link, as far as a body that can exist is left.

    Args:
        whole: inertial parameters (10,) of all that moves with the joint, in its frame.
        others: those of the other bodies, in the same frame.
        fixed: of these the ones that are attached rigidly: they may give the link their inertia.
        joint: name of the joint.

    Returns:
        What is left (10,), which bodies keep nothing, and what share of their inertia the rest keep.

    Raises:
        InfeasibleError: nothing that can exist is left.
    """
    for emptied, share in ((set[Key](), 1.0), *((set(fixed), share) for share in SHARES)):
        kept = [share * body for key, body in others.items() if key not in emptied]
        own = whole - np.sum(kept, axis=0) if kept else whole
        if own[0] > 0.0 and (normalised_eigenvalues(own[None]) > 0).all():
            return own, emptied, share if kept else 1.0
    raise InfeasibleError("the identified link is no body that can exist", remedy=f"{REMEDY} (joint {joint})")

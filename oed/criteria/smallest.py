"""E-optimality: the worst determined direction."""

from __future__ import annotations

import numpy as np

from oed.criteria.base import Array, Criterion, floored, soft_maximum


class SmallestSingularValue(Criterion):
    """sigma_min(Y) = sqrt(lambda_min(Y'Y)), to be maximised."""

    name = "e"
    label = "smallest singular value of Y"
    larger_is_better = True
    stages = (16.0, 64.0)
    finish = (64.0, 256.0, 1024.0)

    def value(self, eigenvalues: Array) -> float:
        """Gives the smallest singular value."""
        return float(np.sqrt(floored(eigenvalues)[0]))

    def surrogate(self, eigenvalues: Array, sharpness: float) -> tuple[float, Array]:
        """Bounds -log sigma_min from above."""
        floor = floored(eigenvalues)
        value, gradient = soft_maximum(-np.log(floor), sharpness)
        return value / 2, -gradient / floor / 2

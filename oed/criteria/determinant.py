"""D-optimality: the volume of the confidence ellipsoid."""

from __future__ import annotations

import numpy as np

from oed.criteria.base import Array, Criterion, floored


class Determinant(Criterion):
    """log det(Y'Y), to be maximised (thesis section 2.2; Swevers et al. 1997)."""

    name = "d"
    label = "log det(Y'Y)"
    larger_is_better = True

    def value(self, eigenvalues: Array) -> float:
        """Gives the natural logarithm of the determinant."""
        return float(np.log(floored(eigenvalues)).sum())

    def surrogate(self, eigenvalues: Array, sharpness: float) -> tuple[float, Array]:
        """Gives minus half the mean logarithm: a log standard error, averaged over the parameter directions."""
        floor = floored(eigenvalues)
        return float(-np.log(floor).mean() / 2), -0.5 / floor / len(floor)

"""The thesis' combination: condition number and determinant together."""

from __future__ import annotations

import numpy as np

from oed.criteria.base import Array, Criterion
from oed.criteria.cond import Cond
from oed.criteria.determinant import Determinant


class CondDeterminant(Criterion):
    """log cond(Y) - weight log det(Y'Y) / (2 m), to be minimised (thesis section 2.3: both, with weights).

    Args:
        weight: of the determinant against the condition number; the default weighs one e-fold of cond(Y) like one
            e-fold of the mean standard error.
    """

    name = "cond-d"
    stages = (16.0, 64.0)
    finish = (64.0, 256.0, 1024.0)

    def __init__(self, weight: float = 1.0) -> None:
        self.weight = weight
        self.label = f"log cond(Y) - {weight:g} log det(Y'Y) / 2m"
        self._cond, self._determinant = Cond(), Determinant()

    def value(self, eigenvalues: Array) -> float:
        """Gives the weighted sum."""
        volume, _ = self._determinant.surrogate(eigenvalues, 1.0)
        return float(np.log(self._cond.value(eigenvalues))) + self.weight * volume

    def surrogate(self, eigenvalues: Array, sharpness: float) -> tuple[float, Array]:
        """Replaces the condition number by its stand-in."""
        cond, cond_gradient = self._cond.surrogate(eigenvalues, sharpness)
        volume, volume_gradient = self._determinant.surrogate(eigenvalues, sharpness)
        return cond + self.weight * volume, cond_gradient + self.weight * volume_gradient

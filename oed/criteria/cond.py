"""The condition number of the regressor."""

from __future__ import annotations

import numpy as np

from oed.criteria.base import Array, Criterion, floored, soft_maximum


class Cond(Criterion):
    """cond(Y) = sqrt(lambda_max / lambda_min) of Y'Y (Gautier and Khalil 1992).

    The square of it is cond(Y'Y); it depends on the columns' units and scaling. The stand-ins replace the largest and
    smallest eigenvalue by Schatten norms: log cond(Y) <= (log ||Y'Y||_p + log ||(Y'Y)^-1||_p) / 2.
    """

    name = "cond"
    label = "cond(Y)"
    stages = (16.0, 64.0)
    finish = (64.0, 256.0, 1024.0)

    def value(self, eigenvalues: Array) -> float:
        """Gives cond(Y)."""
        floor = floored(eigenvalues)
        return float(np.sqrt(floor[-1] / floor[0]))

    def surrogate(self, eigenvalues: Array, sharpness: float) -> tuple[float, Array]:
        """Bounds log cond(Y) from above."""
        floor = floored(eigenvalues)
        logs = np.log(floor)
        top, top_gradient = soft_maximum(logs, sharpness)
        bottom, bottom_gradient = soft_maximum(-logs, sharpness)
        return (top + bottom) / 2, (top_gradient - bottom_gradient) / floor / 2

"""A-optimality: the sum of the parameters' variances."""

from __future__ import annotations

import numpy as np

from oed.criteria.base import Array, Criterion, floored


class Trace(Criterion):
    """trace((Y'Y)^-1), the sum of variances at unit torque noise."""

    name = "a"
    label = "trace((Y'Y)^-1)"

    def value(self, eigenvalues: Array) -> float:
        """Gives the trace of the inverse."""
        return float((1 / floored(eigenvalues)).sum())

    def surrogate(self, eigenvalues: Array, sharpness: float) -> tuple[float, Array]:
        """Gives half its logarithm."""
        inverse = 1 / floored(eigenvalues)
        total = inverse.sum()
        return float(np.log(total) / 2), -(inverse**2) / total / 2

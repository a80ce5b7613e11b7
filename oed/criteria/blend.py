"""Several criteria at once, weighed against each other."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from oed.criteria.base import Array, Criterion
from robots.common.errors import InputError


class Blend(Criterion):
    """sum_i w_i log c_i, to be minimised: each criterion as the logarithm of a standard error, or of a ratio of two.

    The logarithms are those of the criteria's stand-ins: log cond(Y), -log det(Y'Y) / 2m, log trace((Y'Y)^-1) / 2 and
    -log sigma_min(Y). An e-fold of each counts by its weight.

    Its name is a sum of weight*criterion, such as ``0.5*cond+0.5*d``.

    Args:
        parts: criteria and their weights, at least one of which is above zero.

    Raises:
        InputError: a negative weight, or none above zero.
    """

    def __init__(self, parts: Mapping[Criterion, float]) -> None:
        weights = np.array(list(parts.values()), dtype=float)
        if not (np.isfinite(weights).all() and (weights >= 0.0).all() and weights.sum() > 0.0):
            raise InputError(f"weights of criteria {weights}", allowed="zero or more, not all of them zero")
        self.parts = {part: float(weight) for part, weight in parts.items() if weight > 0.0}
        self.name = "+".join(f"{weight:g}*{part.name}" for part, weight in self.parts.items())
        self.label = "weighted logarithms of criteria, " + self.name
        rough = [part for part in self.parts if len(part.stages) > 1] or list(self.parts)
        self.stages, self.finish = rough[0].stages, rough[0].finish

    def value(self, eigenvalues: Array) -> float:
        """Gives the weighted sum of logarithms."""
        # Sharpness at which a stand-in is the criterion to a part in 1e12.
        return self.surrogate(eigenvalues, 1e13)[0]

    def surrogate(self, eigenvalues: Array, sharpness: float) -> tuple[float, Array]:
        """Adds the stand-ins up."""
        total, gradient = 0.0, np.zeros_like(eigenvalues)
        for part, weight in self.parts.items():
            value, slope = part.surrogate(eigenvalues, sharpness)
            total, gradient = total + weight * value, gradient + weight * slope
        return total, gradient

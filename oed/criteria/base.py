"""What a design criterion is: a function of the information matrix's eigenvalues."""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np

from robots.common.arrays import Array


class Criterion(ABC):
    """A number that says how well a motion determines the parameters.

    All criteria are functions of the eigenvalues of the information matrix Y'Y, that is of the squared singular
    values of the regressor Y.

    Attributes:
        name: as the command line spells it.
        label: as reports spell it, saying of which matrix.
        larger_is_better: the sense of `value`.
        stages: sharpness p of the smooth stand-ins that a search minimises one after the other; one of 1 where the
            criterion itself is smooth.
        finish: sharper stand-ins for the end, that bring a non-smooth criterion to its own optimum: at 1024 and 64
            parameters the stand-in exceeds it by less than half a percent.
    """

    name: str
    label: str
    larger_is_better: bool = False
    stages: tuple[float, ...] = (1.0,)
    finish: tuple[float, ...] = ()

    @abstractmethod
    def value(self, eigenvalues: Array) -> float:
        """Gives the criterion as people read it, for eigenvalues (m,) of Y'Y in ascending order."""

    @abstractmethod
    def surrogate(self, eigenvalues: Array, sharpness: float) -> tuple[float, Array]:
        """Gives a smooth function to minimise and its derivatives (m,) by the eigenvalues.

        Args:
            eigenvalues: of Y'Y (m,), ascending.
            sharpness: p, see `stages`.
        """

    def cost(self, eigenvalues: Array) -> float:
        """Gives the criterion itself in the sense of the surrogates, smaller being better, to compare designs by.

        Args:
            eigenvalues: of Y'Y (m,), ascending.
        """
        return -self.value(eigenvalues) if self.larger_is_better else self.value(eigenvalues)


def floored(eigenvalues: Array) -> Array:
    """Lifts eigenvalues that rounding made zero or negative."""
    # Below this share of the largest eigenvalue the smallest ones are rounding errors: the motion excites too little.
    return np.maximum(eigenvalues, 1e-15 * max(float(eigenvalues[-1]), np.finfo(float).tiny))


def soft_maximum(values: Array, sharpness: float) -> tuple[float, Array]:
    """Evaluates log(sum exp(p x)) / p, which exceeds max(x) by at most log(m) / p, and its gradient (m,)."""
    scaled = sharpness * values
    top = scaled.max()
    weights = np.exp(scaled - top)
    total = weights.sum()
    return float((top + np.log(total)) / sharpness), weights / total

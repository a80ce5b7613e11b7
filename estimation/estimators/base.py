"""What an estimator is: a choice of how much each joint's rows count."""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np
from numpy.typing import NDArray

from estimation.moments import Moments

Array = NDArray[np.float64]


class Estimator(ABC):
    """A least-squares estimator on per-joint normal equations.

    Attributes:
        name: as the command line spells it.
    """

    name: str

    @abstractmethod
    def weights(self, moments: Moments, ridge: float) -> Array:
        """Gives the weights of the joints' rows (n,) [1/(N m)^2 or alike]."""

    def solve(self, moments: Moments, ridge: float) -> tuple[Array, Array]:
        """Estimates.

        Args:
            moments: of all data.
            ridge: see `Moments.solve`.

        Returns:
            Parameters (p,) and the weights (n,).
        """
        weights = self.weights(moments, ridge)
        return moments.solve(weights, ridge), weights

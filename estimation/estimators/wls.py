"""Weighted least squares: each joint's rows count by their noise."""

from __future__ import annotations

import numpy as np

from estimation.estimators.base import Array, Estimator
from estimation.regressions.moments import Moments
from robots.common.errors import InputError


class WeightedLeastSquares(Estimator):
    """min sum_j w_j ||tau_j - Y_j pi||^2 with w_j = sigma_j^(-2 temper), sigma_j the residual level of the joint.

    With `temper` 1 this is the textbook's inverse variance (Swevers et al. 1997). The level is that of a fit in which
    each joint counts by its torque, and of two more with the weights found before.

    Args:
        temper: 0 (ordinary least squares) to 1.

    Raises:
        InputError: a temper outside 0 to 1.
    """

    name = "wls"

    def __init__(self, temper: float = 1.0) -> None:
        if not 0 <= temper <= 1:
            raise InputError(f"a temper of {temper}", allowed="0 to 1")
        self.temper = temper

    def weights(self, moments: Moments, ridge: float) -> Array:
        """Gives the inverse residual level to the power of twice the temper (n,)."""
        torque = moments.square / np.maximum(moments.count, 1)
        # A joint's mean square torque counts as this share of the largest one's at least.
        weights = np.maximum(torque, 1e-12 * float(torque.max()) + np.finfo(float).tiny) ** -self.temper
        for _ in range(2):
            weights = moments.level(moments.solve(weights, ridge)) ** (-2 * self.temper)
        return weights

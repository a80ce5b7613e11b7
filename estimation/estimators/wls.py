"""Weighted least squares: each joint's rows count by their noise."""

from __future__ import annotations

import numpy as np

from estimation.estimators.base import Array, Estimator
from estimation.regressions.moments import Moments
from robots.common.errors import InputError


class WeightedLeastSquares(Estimator):
    """min sum_j w_j ||tau_j - Y_j pi||^2 with w_j = sigma_j^(-2 temper), sigma_j the residual level of least squares.

    With `temper` 1 this is the textbook's inverse variance (Swevers et al. 1997). On measured logs most of a residual
    is what the model lacks, not noise: full weights would then hand the shared parameters to whichever joint happens
    to be modelled best. Reweighted once, for the same reason.

    Args:
        temper: 0 (ordinary least squares) to 1.

    Raises:
        InputError: a temper outside 0 to 1.
    """

    name = "wls"

    def __init__(self, temper: float = 0.5) -> None:
        if not 0 <= temper <= 1:
            raise InputError(f"a temper of {temper}", allowed="0 to 1")
        self.temper = temper

    def weights(self, moments: Moments, ridge: float) -> Array:
        """Gives the inverse residual level to the power of twice the temper (n,)."""
        first = moments.solve(np.ones(len(moments.count)), ridge)
        return moments.level(first) ** (-2 * self.temper)

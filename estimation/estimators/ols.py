"""Ordinary least squares."""

from __future__ import annotations

import numpy as np

from estimation.estimators.base import Array, Estimator
from estimation.regressions.moments import Moments


class OrdinaryLeastSquares(Estimator):
    """min ||tau - Y pi||^2 over all joints alike (thesis eq. 59)."""

    name = "ols"

    def weights(self, moments: Moments, ridge: float) -> Array:
        """Gives ones (n,)."""
        return np.ones(len(moments.count))

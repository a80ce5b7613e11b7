"""Interface of estimators: weights of the joints' rows, and further results."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from estimation.regressions.moments import Moments
from estimation.regressions.regression_data import RegressionData
from robots.common.arrays import Array


@dataclass(frozen=True, kw_only=True)
class Solution:
    """Result of an estimator.

    Attributes:
        values: base parameters (b,).
        weights: of the joints' rows (n,) [1/(N m)^2 or alike].
        row_weights: where rows of one joint count unlike: residual (N, n) -> factors (N, n) from 0 to 1.
        covariance: of the values (b, b), where the estimator has its own; None leaves it to the fit's residual.
        extras: what else it found: ``standard``, standard parameters (p,) in the torque model's column order, and
            whatever the estimator's own docstring names.
    """

    values: Array
    weights: Array
    row_weights: Callable[[Array], Array] | None = None
    covariance: Array | None = None
    extras: Mapping[str, Any] = field(default_factory=dict)


class Estimator(ABC):
    """An estimator of base parameters: least squares on per-joint normal equations, then its own refinement.

    Attributes:
        name: as the command line spells it.
        simulates: whether it simulates the robot, which it then takes to carry nothing and to stand as described.
    """

    name: str
    simulates: bool = False

    @abstractmethod
    def weights(self, moments: Moments, ridge: float) -> Array:
        """Gives the weights of the joints' rows (n,) [1/(N m)^2 or alike]."""

    def solve(self, moments: Moments, ridge: float) -> tuple[Array, Array]:
        """Estimates from normal equations alone.

        Args:
            moments: of all data.
            ridge: see `Moments.solve`.

        Returns:
            Parameters (p,) and the weights (n,).
        """
        weights = self.weights(moments, ridge)
        return moments.solve(weights, ridge), weights

    def refine(self, data: RegressionData, values: Array, weights: Array) -> Solution:
        """Estimates from all that is known of the data, starting from what `solve` found.

        Args:
            data: motion, torque and regressor.
            values: base parameters (b,).
            weights: of the joints' rows (n,).

        Returns:
            The solution; by default that of `solve`.
        """
        return Solution(values=values, weights=weights)

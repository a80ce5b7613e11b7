"""Estimators, one a file."""

from __future__ import annotations

from estimation.closed_loops.closed_loop import Controller
from estimation.estimators.base import Estimator, Solution
from estimation.estimators.consistent import PhysicallyConsistent
from estimation.estimators.constrained import ConstrainedLeastSquares
from estimation.estimators.didim import DirectAndInverse
from estimation.estimators.irls import Huber, Tukey
from estimation.estimators.iv import InstrumentalVariables
from estimation.estimators.ml import MaximumLikelihood
from estimation.estimators.ols import OrdinaryLeastSquares
from estimation.estimators.recursive import RecursiveLeastSquares, Stream
from estimation.estimators.simulated import Loop
from estimation.estimators.tls import TotalLeastSquares
from estimation.estimators.wls import WeightedLeastSquares
from estimation.regressions.regression_data import RegressionData
from robots.common.registry import Registry, subclass_check

_ORDER = (
    WeightedLeastSquares,
    OrdinaryLeastSquares,
    Huber,
    Tukey,
    TotalLeastSquares,
    ConstrainedLeastSquares,
    PhysicallyConsistent,
    InstrumentalVariables,
    MaximumLikelihood,
    DirectAndInverse,
    RecursiveLeastSquares,
)
ESTIMATORS: Registry[type[Estimator]] = Registry(
    "method", "robot_oed.estimators", _ORDER, check=subclass_check(Estimator)
)


def estimator(choice: str | Estimator) -> Estimator:
    """Gives the estimator of that name, or the one given.

    Raises:
        InputError: an unknown name.
    """
    if isinstance(choice, Estimator):
        return choice
    return ESTIMATORS.get_or_raise(choice)()


__all__ = [
    "ESTIMATORS",
    "ConstrainedLeastSquares",
    "Controller",
    "DirectAndInverse",
    "Estimator",
    "Huber",
    "InstrumentalVariables",
    "Loop",
    "MaximumLikelihood",
    "OrdinaryLeastSquares",
    "PhysicallyConsistent",
    "RecursiveLeastSquares",
    "RegressionData",
    "Solution",
    "Stream",
    "TotalLeastSquares",
    "Tukey",
    "WeightedLeastSquares",
    "estimator",
]

"""Estimators, one a file."""

from __future__ import annotations

from estimation.estimators.base import Estimator
from estimation.estimators.ols import OrdinaryLeastSquares
from estimation.estimators.wls import WeightedLeastSquares
from robots.common.errors import InputError

ESTIMATORS: dict[str, type[Estimator]] = {kind.name: kind for kind in (WeightedLeastSquares, OrdinaryLeastSquares)}


def estimator(choice: str | Estimator) -> Estimator:
    """Gives the estimator of that name, or the one given.

    Raises:
        InputError: an unknown name.
    """
    if isinstance(choice, Estimator):
        return choice
    if choice not in ESTIMATORS:
        raise InputError(f"method {choice!r}", allowed=", ".join(ESTIMATORS))
    return ESTIMATORS[choice]()


__all__ = ["ESTIMATORS", "Estimator", "OrdinaryLeastSquares", "WeightedLeastSquares", "estimator"]

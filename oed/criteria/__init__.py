"""Design criteria, one a file: functions of the information matrix's eigenvalues."""

from __future__ import annotations

from oed.criteria.base import Criterion
from oed.criteria.combined import CondDeterminant
from oed.criteria.cond import Cond
from oed.criteria.determinant import Determinant
from oed.criteria.information import Information, singular_values, triangle
from oed.criteria.prediction import PredictionVariance
from oed.criteria.smallest import SmallestSingularValue
from oed.criteria.trace import Trace
from oed.criteria.weighting import SCALINGS, Prior, Weighting, nominal_scale, task_transform
from robots.common.errors import InputError

CRITERIA: dict[str, type[Criterion]] = {
    kind.name: kind for kind in (Cond, Determinant, Trace, SmallestSingularValue, PredictionVariance, CondDeterminant)
}


def criterion(choice: str | Criterion) -> Criterion:
    """Gives the criterion of that name, or the one given.

    Raises:
        InputError: an unknown name.
    """
    if isinstance(choice, Criterion):
        return choice
    if choice not in CRITERIA:
        raise InputError(f"criterion {choice!r}", allowed=", ".join(CRITERIA))
    return CRITERIA[choice]()


__all__ = [
    "CRITERIA",
    "SCALINGS",
    "Cond",
    "CondDeterminant",
    "Criterion",
    "Determinant",
    "Information",
    "PredictionVariance",
    "Prior",
    "SmallestSingularValue",
    "Trace",
    "Weighting",
    "criterion",
    "nominal_scale",
    "singular_values",
    "task_transform",
    "triangle",
]

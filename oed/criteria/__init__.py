"""Design criteria, one a file: functions of the information matrix's eigenvalues."""

from __future__ import annotations

import sys

import numpy as np

from oed.criteria.base import Criterion
from oed.criteria.blend import Blend
from oed.criteria.combined import CondDeterminant
from oed.criteria.cond import Cond
from oed.criteria.determinant import Determinant
from oed.criteria.information import Information, singular_values, triangle
from oed.criteria.prediction import PredictionVariance
from oed.criteria.smallest import SmallestSingularValue
from oed.criteria.trace import Trace
from oed.criteria.weighting import SCALINGS, Prior, Weighting, nominal_scale, task_transform
from robots.common.errors import InputError
from robots.common.registry import Registry, members_of, subclass_check

CRITERIA: Registry[type[Criterion]] = Registry(
    "criterion",
    "robot_oed.criteria",
    members_of(sys.modules[__name__], Criterion),  # type: ignore[type-abstract]
    check=subclass_check(Criterion),
)


def criterion(choice: str | Criterion) -> Criterion:
    """Gives the criterion of that name, the one given, or a blend such as ``0.5*cond+0.5*d``.

    Raises:
        InputError: an unknown name, or weights that are not numbers.
    """
    if isinstance(choice, Criterion):
        return choice
    if choice in CRITERIA:
        return CRITERIA[choice]()
    parts: dict[Criterion, float] = {}
    for item in choice.split("+"):
        weight, star, name = item.partition("*")
        if not star or not _is_number(weight) or name.strip() not in CRITERIA:
            if "*" not in choice:
                CRITERIA.refuse_failed(choice)
            blends = "or a sum of weight*criterion such as 0.5*cond+0.5*d"
            raise InputError(f"criterion {choice!r}", allowed=f"{', '.join(CRITERIA)}, {blends}")
        parts[CRITERIA[name.strip()]()] = float(weight)
    return Blend(parts)


def _is_number(text: str) -> bool:
    try:
        return bool(np.isfinite(float(text)))
    except ValueError:
        return False


__all__ = [
    "CRITERIA",
    "SCALINGS",
    "Blend",
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

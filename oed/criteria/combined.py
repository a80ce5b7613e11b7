"""The thesis' combination: condition number and determinant together."""

from __future__ import annotations

from oed.criteria.blend import Blend
from oed.criteria.cond import Cond
from oed.criteria.determinant import Determinant


class CondDeterminant(Blend):
    """log cond(Y) - weight log det(Y'Y) / (2 m), to be minimised (thesis section 2.3: both, with weights).

    Args:
        weight: of the determinant against the condition number; the default weighs one e-fold of cond(Y) like one
            e-fold of the mean standard error.
    """

    name = "cond-d"

    def __init__(self, weight: float = 1.0) -> None:
        super().__init__({Cond(): 1.0, Determinant(): weight})
        self.name, self.weight = CondDeterminant.name, weight
        self.label = f"log cond(Y) - {weight:g} log det(Y'Y) / 2m"

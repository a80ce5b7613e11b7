"""Criteria weighed against each other."""

from __future__ import annotations

import numpy as np
import pytest

from oed.criteria import Blend, Cond, Determinant, Trace, criterion
from robots.common.errors import InputError

EIGENVALUES = np.array([0.5, 2.0, 3.0, 80.0])


def test_value_is_the_weighted_sum_of_logarithms() -> None:
    """0.25 log cond(Y) - 0.75 log det(Y'Y) / 2m, by hand."""
    by_hand = 0.25 * np.log(80.0 / 0.5) / 2 - 0.75 * np.log(EIGENVALUES.prod()) / 8
    assert Blend({Cond(): 0.25, Determinant(): 0.75}).value(EIGENVALUES) == pytest.approx(by_hand, rel=1e-11)


def test_gradient_is_exact() -> None:
    """The stand-in's gradient equals central differences."""
    blend = Blend({Cond(): 0.2, Determinant(): 0.3, Trace(): 0.5})
    _, gradient = blend.surrogate(EIGENVALUES, 16.0)
    for i, value in enumerate(EIGENVALUES):
        step = 1e-5 * value * np.eye(4)[i]
        ends = [blend.surrogate(EIGENVALUES + sign * step, 16.0)[0] for sign in (1, -1)]
        # The central difference is off by step^2 times a third derivative of order 16^2: 1e-8.
        assert gradient[i] * 2 * step[i] == pytest.approx(ends[0] - ends[1], rel=1e-6)


def test_a_name_makes_the_same_blend_again() -> None:
    """The name of a blend, as a design file keeps it, is read as that blend; criteria without weight are left out."""
    blend = Blend({Cond(): 0.25, Determinant(): 0.75, Trace(): 0.0})
    assert blend.name == "0.25*cond+0.75*d"
    again = criterion(blend.name)
    assert again.value(EIGENVALUES) == blend.value(EIGENVALUES)
    assert criterion(" 0.25*cond + 0.75*d ").value(EIGENVALUES) == blend.value(EIGENVALUES)


def test_stages_are_those_of_a_criterion_that_is_not_smooth() -> None:
    """With cond in it a blend is sharpened in stages; of smooth criteria alone it is not."""
    assert Blend({Determinant(): 0.5, Cond(): 0.5}).finish == Cond.finish
    assert Blend({Determinant(): 0.5, Trace(): 0.5}).stages == (1.0,)


@pytest.mark.parametrize("name", ["0.5*cond+0.5*nonsense", "x*cond", "cond+d", "inf*cond+1*d", "+"])
def test_nonsense_is_refused(name: str) -> None:
    """What is no sum of weight*criterion is refused with what is allowed."""
    with pytest.raises(InputError, match=r"0.5\*cond"):
        criterion(name)


@pytest.mark.parametrize("weights", [(-1.0, 2.0), (0.0, 0.0), (np.nan, 1.0)])
def test_weights_out_of_range_are_refused(weights: tuple[float, float]) -> None:
    """Weights are zero or more, and not all zero."""
    with pytest.raises(InputError, match="weights"):
        Blend(dict(zip((Cond(), Determinant()), weights, strict=True)))

"""Tests of the comparison of named effects with free functions in their place."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest

from estimation.diagnosis.calibration import (
    MIN_BIC_GAIN,
    MIN_EXPLAINED_SHARE,
    NEARLY_EXPLAINED_SHARE,
)
from estimation.diagnosis.hypothesis_tests.fitted_effects import FittedEffect
from estimation.diagnosis.hypothesis_tests.hypotheses import Hypothesis
from estimation.diagnosis.searches.selection import SelectedEffect
from estimation.diagnosis.validations import name_comparison
from estimation.diagnosis.validations.name_comparison import ComparedNames, compare_with_free_functions
from robots.terms.discrepancies.patterns import Pattern
from tests.estimation.diagnosis.comparison_bench import PRICE, ROWS, adding, member_of

PROBLEM: Any = SimpleNamespace(rows=ROWS, n=3)


def _function(kind: str, joint: int | None, gain: float, degrees: int) -> FittedEffect:
    return replace(member_of("spring", joint, gain, degrees), hypothesis=Hypothesis(Pattern(kind), joint))


def _compared(
    monkeypatch: pytest.MonkeyPatch,
    names: Sequence[FittedEffect],
    in_place: Sequence[FittedEffect] = (),
    left: Sequence[FittedEffect] = (),
) -> ComparedNames:
    """Compares named effects with free functions `in_place` of them, and others for what they have `left`."""
    adding(monkeypatch, {id(m.group): m.gain for m in (*names, *in_place, *left)})

    def free(
        problem: object,
        entries: object,
        beside: Sequence[FittedEffect],
        chance: float,
        *,
        alone: bool = False,
        most: int = 0,
    ) -> tuple[list[FittedEffect], list[float]]:
        functions = list(left) if alone else list(in_place)
        return functions, [1e-30] * len(functions)

    monkeypatch.setattr(name_comparison, "free_functions", free)
    monkeypatch.setattr(name_comparison, "_is_plausible", lambda *arguments: True)
    selection: Any = SimpleNamespace(found=tuple(SelectedEffect(member, 1e-9) for member in names))
    return compare_with_free_functions(PROBLEM, selection, [], 0.01)


@pytest.mark.parametrize(
    ("gain", "degrees", "stands"),
    [
        (500.0, 6, True),  # as much, with more parameters
        (545.0, 4, True),  # more, but within the formula error
        (600.0, 6, False),  # clearly more, with a better BIC
        (600.0, 30, True),  # clearly more, but with far more parameters
        (515.0, 2, False),  # hardly more, but with as few parameters: no error of the formula
        (505.0, 2, True),  # not clearly more
        (900.0, 90, False),  # at any number of parameters, because the finding leaves a third
    ],
)
def test_a_name_stands_where_no_function_in_its_place_is_clearly_better(
    gain: float, degrees: int, stands: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An effect with a gain of 500 and two parameters is compared with one free function."""
    name, function = member_of("stribeck", 1, 500.0, 2), _function("drag", 1, gain, degrees)
    excess, most = 498.0, gain - degrees
    assert stands is (
        excess >= MIN_EXPLAINED_SHARE * most
        and (
            (degrees > 2 and excess >= NEARLY_EXPLAINED_SHARE * most)
            or gain - degrees * PRICE <= 500.0 - 2 * PRICE + MIN_BIC_GAIN
        )
    )
    result = _compared(monkeypatch, [name], in_place=[function])
    assert [found.effect for found in result.named] == ([name] if stands else [])


def test_of_several_names_on_a_joint_the_weakest_goes_first(monkeypatch: pytest.MonkeyPatch) -> None:
    """If a function outperforms two findings of a joint, they are left out one by one; others stay."""
    names = [member_of("stribeck", 3, 300.0, 3), member_of("spring", 3, 90.0, 4), member_of("spring", 2, 80.0, 4)]
    here = _function("turns", 3, 700.0, 8)
    asked: list[tuple[str, ...]] = []
    adding(monkeypatch, {id(m.group): m.gain for m in (*names, here)})

    def free(
        problem: object,
        entries: object,
        beside: Sequence[FittedEffect],
        chance: float,
        *,
        alone: bool = False,
        most: int = 0,
    ) -> tuple[list[FittedEffect], list[float]]:
        if alone or {m.hypothesis.joint for m in beside} != {2}:
            return [], []
        asked.append(tuple(m.hypothesis.label for m in beside))
        return [here], [1e-30]

    monkeypatch.setattr(name_comparison, "free_functions", free)
    monkeypatch.setattr(name_comparison, "_is_plausible", lambda *arguments: True)
    selection: Any = SimpleNamespace(found=tuple(SelectedEffect(member, 1e-9) for member in names))
    result = compare_with_free_functions(PROBLEM, selection, [], 0.01)
    assert [found.effect.hypothesis.label for found in result.named] == ["spring of joint 2"]
    assert asked == [("spring of joint 2",)] * 2


@pytest.mark.parametrize(("left", "unexplained"), [(150.0, False), (600.0, True)])
def test_what_names_leave_is_unexplained_if_it_is_much(
    left: float, unexplained: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A remainder of more than 30 % of all is unexplained; a smaller one is formula error."""
    name, rest = member_of("stribeck", 1, 500.0, 2), _function("angle", 2, left, 4)
    result = _compared(monkeypatch, [name], left=[rest])
    assert result.free_functions == ((rest,) if unexplained else ())
    assert result.p_values == ((1e-30,) if unexplained else ())
    assert [found.effect for found in result.named] == [name]
    assert result.explained == pytest.approx(500.0 / (500.0 + left - 4))


def test_without_names_and_functions_nothing_is_left(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without findings and functions everything is explained."""
    result = _compared(monkeypatch, [])
    assert (result.named, result.free_functions, result.p_values, result.explained) == ((), (), (), 1.0)

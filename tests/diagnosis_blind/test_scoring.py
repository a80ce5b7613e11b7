"""The benchmark's figures and the judge of the hidden cases, on rows whose right score is known."""

from __future__ import annotations

from typing import Any

import pytest

from benchmarks.diagnosis_parts.figures import figures
from benchmarks.diagnosis_parts.statistics import (
    SHAPES,
    TIMES,
    both,
    detected,
    errors_left,
    file_over_reported,
    first_is_right,
    gain_ratios,
    parameter_errors,
    spurious,
    within_limits,
)
from benchmarks.diagnosis_parts.strata import STRATA, TUNING, tasks
from oed.benchmarks.truth.effects.friction import FrictionStep, Stribeck
from oed.benchmarks.truth.effects.unlisted_joint_effects import CrossWave
from tests.diagnosis_blind.judging import Truth, complaints

AFTER = {"after_extension": 3.2e-3, "oracle_before": 4.5e-3, "oracle_after": 3e-3}


def row(found: list[tuple[str, int | None]], hidden: list[tuple[str, int | None]], **more: Any) -> dict[str, Any]:
    """A row of the benchmark."""
    findings = [
        {"effect": e, "joint": j, "parameters": [], "p_value": 1e-6, "delta_bic": 50.0, "rivals": []} for e, j in found
    ]
    truth = [
        {"effect": e, "kind": e, "joint": j, "amount": 1.0, "visible": 0.01, "lasting": True, "parameters": {}}
        for e, j in hidden
    ]
    base = {"key": "one-1", "status": "done", "stratum": "one", "seed": 1, "motion": "periodic", "robot": "ur10"}
    cost = {"cpu": 1.0, "wall": 1.0, "memory": 100.0, "verdict": "named" if found else "none"}
    return {**base, **cost, "findings": findings, "truth": truth, **more}


def test_scores_of_known_rows() -> None:
    """Right and wrong names, both of two effects, a spurious one and the gain are counted as they should be."""
    right = row([("stribeck", 2)], [("stribeck", 2)], before=4e-3, **AFTER)
    wrong = row([("stribeck", 3)], [("stribeck", 2)])
    two = row([("spring", 2), ("stribeck", 1), ("backlash", 4)], [("stribeck", 1), ("spring", 2)])
    silent = row([], [("stribeck", 2)])
    assert errors_left([right, silent]) == pytest.approx([3.2 / 3])
    assert detected(right)
    assert not detected(silent)
    assert first_is_right(right)
    assert not first_is_right(wrong)
    assert both(two)
    assert spurious(two)
    assert not spurious(right)
    assert gain_ratios([right, silent]) == pytest.approx([0.8])
    text = figures([right, wrong, silent])
    assert "2 of 3" in next(line for line in text.splitlines() if "detected at 1 %" in line)
    assert "1 of 3" in next(line for line in text.splitlines() if "first name right" in line)


@pytest.mark.parametrize(
    ("before", "after", "ratio"), [(4.6e-3, 3.2e-3, 1.4 / 1.5), (5.5e-3, 4.3e-3, 0.8), (7e-3, 3e-3, 1.0)]
)
def test_a_worse_base_model_keeps_its_gain_and_makes_none(before: float, after: float, ratio: float) -> None:
    """An error with and without the effect is no part of the gain, and a base model's own that goes is no gain."""
    seen = row([("stribeck", 2)], [("stribeck", 2)], **AFTER | {"before": before, "after_extension": after})
    assert gain_ratios([seen]) == pytest.approx([ratio])


def test_the_file_of_a_model_is_held_to_what_was_reported_of_it() -> None:
    """Joint by joint where something was found; what a diagnosis says of an unseen log, its model must predict."""
    errors = {"before": [4e-3, 1e-3], "after_extension": [1e-4, 4e-4], "by_file": [1e-4, 9e-4]}
    seen = row([("stribeck", 2)], [("stribeck", 2)], **AFTER | errors)
    assert file_over_reported([seen]) == pytest.approx([1.0, 1.5])
    assert "largest 1.50" in figures([seen])
    assert not len(file_over_reported([row([], [("stribeck", 2)], **AFTER | errors)]))


def test_a_gain_is_held_to_formulas_and_logged_positions_too() -> None:
    """What the logged positions do not show is not to be gained by any model of the effect."""
    seen = row([("backlash", 2)], [("backlash", 2)], **AFTER, before=4.5e-3, oracle_as_measured=[3.2e-3])
    assert gain_ratios([seen]) == pytest.approx([1.3 / 1.5])
    assert gain_ratios([seen], "oracle_as_measured") == pytest.approx([1.0])
    assert "lowest tenth 0.87" in figures([seen])
    assert "motion as logged, 1 cases" in figures([seen])


def test_a_gain_is_held_to_what_is_possible_on_each_joint() -> None:
    """A base model that is better on the effect's joint leaves less to gain there, whatever it is on the others."""
    better = {"before": [4.2e-3, 3.5e-3], "after_extension": [3.3e-3, 3.5e-3]}
    possible = {"oracle_before": [4.5e-3, 3.1e-3], "oracle_after": [3.2e-3, 3.1e-3]}
    seen = row([("stribeck", 1)], [("stribeck", 1)], **better, **possible)
    assert gain_ratios([seen]) == pytest.approx([0.9])
    # What the base model alone does better on another joint is not to be gained, nor taken off.
    other = possible | {"oracle_after": [3.2e-3, 3.6e-3]}
    assert gain_ratios([row([("stribeck", 1)], [("stribeck", 1)], **better, **other)]) == pytest.approx([0.9])


def test_what_is_below_the_stated_limit_is_no_miss_of_it() -> None:
    """An effect of 1 % is held to a limit that its report states for its own joint, where that is 1 % or less."""

    def stated(size: float | None, joint: int = 2) -> dict[str, Any]:
        return row([], [("stribeck", 2)], limits=[{"effect": "stribeck", "joint": joint, "detectable": size}])

    assert within_limits(stated(0.008))
    assert not within_limits(stated(0.012))
    assert not within_limits(stated(None))
    assert not within_limits(stated(0.008, joint=3))
    seen = row([("stribeck", 2)], [("stribeck", 2)], limits=stated(0.008)["limits"], before=4e-3, **AFTER)
    text = figures([seen, stated(0.008), stated(0.012)])
    assert "1 of 2" in next(line for line in text.splitlines() if "limit that is stated" in line)


@pytest.mark.parametrize(
    ("name", "true", "reported", "ci95", "inside", "determined"),
    [
        ("change_time", 40.0, 40.3, [39.9, 40.7], True, False),
        ("change_time", 40.0, 40.3, [40.15, 40.45], False, True),
        ("stribeck_velocity", 0.1, 0.15, [0.09, 0.16], True, True),
        ("stribeck_velocity", 0.1, 0.15, [None, None], False, False),
    ],
)
def test_errors_of_parameters(
    name: str, true: float, reported: float, ci95: list[float | None], inside: bool, determined: bool
) -> None:
    """A parameter is marked as less sure where the diagnosis does not call it determined."""
    seen = row([("stribeck", 2)], [("stribeck", 2)])
    seen["truth"][0]["parameters"] = {name: true}
    seen["findings"][0]["parameters"] = [{"name": name, "value": reported, "ci95": ci95, "determined": determined}]
    (error,) = parameter_errors([seen], TIMES | SHAPES)
    assert error["absolute"] == pytest.approx(reported - true)
    assert error["relative"] == pytest.approx((reported - true) / true)
    assert (error["inside"], error["marked"]) == (inside, not determined)


def test_benchmark_seeds_are_not_the_tuners() -> None:
    """The full benchmark has 300 logs without an effect, and all its seeds are below those that tuning may use."""
    listed = list(tasks(list(STRATA), 1.0, 0))
    assert sum(task.stratum == "none" for task in listed) == 300
    assert max(task.seed for task in listed) < TUNING
    assert len({task.key for task in listed}) == len(listed)


def said(verdict: str, found: list[tuple[str, int | None]], gain: float = 0.0) -> dict[str, Any]:
    """The contents of a diagnosis."""
    findings = [{"effect": e, "joint": j, "parameters": []} for e, j in found]
    return {
        "verdict": verdict,
        "findings": findings,
        "baseline": {"nrmse": [0.05]},
        "extended": {"nrmse": [(0.05**2 - gain) ** 0.5]},
    }


def test_judge_complains_of_what_is_wrong_and_of_nothing_else() -> None:
    """A right diagnosis passes; a wrong verdict, name, joint, change time or gain does not."""
    truth = Truth(effects=(Stribeck(joint=2),), before=0.05**2, after=0.05**2 - 1e-4)
    assert complaints(truth, said("named", [("stribeck", 2)], 1e-4)) == []
    for verdict, found, gain in (
        ("none", [], 0.0),
        ("ambiguous", [("stribeck", 2)], 1e-4),
        ("named", [("stribeck", 3)], 1e-4),
        ("named", [("stribeck", 2), ("spring", 2)], 1e-4),
        ("named", [("stribeck", 2)], 0.2e-4),
    ):
        assert complaints(truth, said(verdict, found, gain))
    step = said("named", [("friction_step", 1)])
    step["findings"][0]["parameters"] = [{"name": "change_time", "value": 31.0, "ci95": [30.9, 31.1]}]
    assert complaints(Truth(effects=(FrictionStep(joint=1, moment=31.1),)), step) == []
    assert complaints(Truth(effects=(FrictionStep(joint=1, moment=32.0),)), step)
    strange = Truth(effects=(CrossWave(joint=1),))
    assert complaints(strange, said("unexplained", [("unexplained", 1)])) == []
    assert complaints(strange, said("named", [("spring", 1)]))
    assert complaints(Truth(effects=()), said("none", [])) == []

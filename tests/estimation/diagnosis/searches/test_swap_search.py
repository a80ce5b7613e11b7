"""Tests of the refinement of effects beside each other, with rivals tried in their place."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import pytest

from estimation.diagnosis.hypothesis_tests import fitted_effects
from estimation.diagnosis.hypothesis_tests.hypotheses import Hypothesis
from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.hypothesis_tests.refinement import refine
from estimation.diagnosis.hypothesis_tests.scan import measure
from estimation.diagnosis.hypothesis_tests.scoring import accept
from estimation.diagnosis.recordings.log_reading import build_recording
from estimation.diagnosis.searches import swap_search
from robots.common.forks import forked
from robots.robot import Robot
from robots.signals import Log
from robots.terms.effects import EFFECTS

A, B, C = (Hypothesis(EFFECTS[name], 1) for name in ("stribeck", "spring", "time_delay"))
LAG, RIPPLE = Hypothesis(EFFECTS["current_lag"], 1), Hypothesis(EFFECTS["torque_ripple"], 2)
DELAY = Hypothesis(EFFECTS["time_delay"], None)


@dataclass(frozen=True)
class Refined:
    """What a comparison reads of a fit."""

    hypothesis: Hypothesis
    shape: tuple[float, ...]
    bic_gain: float


def test_a_shape_that_is_known_is_refined_from_too(monkeypatch: pytest.MonkeyPatch) -> None:
    """A candidate is also refined from its known shape, and the better result counts."""

    def refine(problem, hypothesis, shape, accepted):
        return Refined(hypothesis, shape, bic_gain=10.0 * shape[0])

    monkeypatch.setattr(swap_search, "refine", refine)
    outcomes = [SimpleNamespace(hypothesis=A, shape=(1.0,)), SimpleNamespace(hypothesis=B, shape=(2.0,))]
    problem = SimpleNamespace(rows=100)
    best = swap_search.refine_candidates(problem, outcomes, None, {A: (3.0,), C: (9.0,)})  # type: ignore[arg-type]
    assert [(m.hypothesis, m.shape) for m in best] == [(A, (3.0,)), (B, (2.0,))]
    worse = swap_search.refine_candidates(problem, outcomes, None, {A: (0.5,)})  # type: ignore[arg-type]
    assert [(m.hypothesis, m.shape) for m in worse] == [(B, (2.0,)), (A, (1.0,))]


@pytest.mark.parametrize(("gain", "tried"), [(99.0, False), (90.0, True), (110.0, True)])
def test_rivals_are_tried_again_where_what_is_beside_changes_a_gain(
    gain: float, tried: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Rivals of an effect are tried again if its gain has changed since its selection, and not otherwise.

    A rival with twice the gain then takes its place.
    """

    def member(hypothesis: Hypothesis, gain: float) -> SimpleNamespace:
        return SimpleNamespace(
            hypothesis=hypothesis,
            group=SimpleNamespace(joints=(0,)),
            shape=(),
            gain=gain,
            bic_gain=gain,
            local_bic_gain=gain,
        )

    looked: list[int] = []
    gains = {A: gain, B: 100.0, C: 2 * gain}

    def scan(problem, entries, accepted):
        looked.append(1)
        return SimpleNamespace(outcomes=[])

    monkeypatch.setattr(fitted_effects, "accept", lambda problem, groups: groups)
    monkeypatch.setattr(swap_search, "accept_all_but", lambda problem, members, i: ())
    monkeypatch.setattr(swap_search, "with_total_torque", lambda problem, members, hypotheses: problem)
    monkeypatch.setattr(swap_search, "refine", lambda problem, h, shape, beside: member(h, gains[h]))
    monkeypatch.setattr(swap_search, "_refined", lambda starts, beside: [member(h, gains[h]) for _, h, _ in starts])
    monkeypatch.setattr(swap_search, "remeasure", lambda problem, m, beside: member(m.hypothesis, gains[m.hypothesis]))
    monkeypatch.setattr(swap_search, "scan", scan)
    monkeypatch.setattr(swap_search, "screen_candidates", lambda *args: [SimpleNamespace(hypothesis=C, shape=())])
    won = {A: 100.0, B: 100.0}
    members, _ = swap_search.refine_with_swaps(
        SimpleNamespace(rows=1000),  # type: ignore[arg-type]
        [],
        [member(A, 100.0), member(B, 100.0)],  # type: ignore[list-item]
        [0.0, 0.0],
        set(),
        won,
        0.01,
    )
    assert len(looked) == int(tried)
    assert [m.hypothesis for m in members] == [C if tried else A, B]
    assert won.get(C, 0.0) == (2 * gain if tried else 0.0)


@pytest.fixture(scope="module")
def late(arm: Robot, arm_log: Callable[..., Log], pose_arm: Callable[..., Problem]) -> Problem:
    """Returns a log with a delay of 6 ms on all joints, and a large ripple on joint 2 that hides it there."""
    recording = build_recording(arm, [arm_log(torque_noise=0.01)])
    situation = pose_arm(recording).situation
    tau = recording.tau + DELAY.effect.columns(situation, None, (0.006,))[:, :, 0] * 0.006
    ripple = RIPPLE.effect.columns(situation, 2, (40.0, 0.006, 0.0))[:, :, 0] * 0.5
    return pose_arm(replace(recording, tau=tau + ripple))


@pytest.mark.slow
def test_a_rival_on_the_joint_of_the_newest_takes_the_place_of_one_that_won(
    late: Problem, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A lag of joint 1 is replaced by a delay of all joints, once the ripple on joint 2 is in the model.

    No thread computes while processes are forked, because a lock that it holds would stay closed in them.
    """
    threads: list[int] = []

    def counting(function: Callable[..., Any], items: Sequence[Any]) -> list[Any]:
        threads.append(threading.active_count())
        return forked(function, items)

    monkeypatch.setattr(swap_search, "forked", counting)
    before = threading.active_count()
    lag = refine(late, LAG, (0.003,), accept(late, ()))
    ripple = refine(late, RIPPLE, (40.0, 0.0, 0.0), accept(late, (lag.group,)))
    lag = refine(late, LAG, lag.shape, accept(late, (ripple.group,)))
    won = {LAG: lag.gain, RIPPLE: ripple.gain}
    entries = measure(late, [LAG, RIPPLE, DELAY])
    members, _ = swap_search.refine_with_swaps(late, entries, [lag, ripple], [0.0, 0.0], set(), won, 0.01)
    assert [m.hypothesis for m in members] == [DELAY, RIPPLE]
    assert members[0].coefficients[0] == pytest.approx(0.006, rel=0.25)
    assert threads
    assert max(threads) <= before


@pytest.mark.parametrize(("together", "chosen"), [(260.0, [C, B]), (190.0, [A, B])])
def test_a_rival_is_tried_with_the_others_refined_beside_it(
    together: float, chosen: list[Hypothesis], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A rival is accepted or rejected with the other effects refined beside it."""

    def member(hypothesis: Hypothesis, gain: float, form: str = "") -> SimpleNamespace:
        group = SimpleNamespace(joints={A: (0,), B: (1,), C: (0, 1)}[hypothesis], form=(hypothesis, form))
        return SimpleNamespace(
            hypothesis=hypothesis,
            group=group,
            shape=(),
            gain=gain,
            bic_gain=gain,
            local_bic_gain=gain,
        )

    def refined(problem, hypothesis, shape, beside) -> SimpleNamespace:
        forms = {group.form for group in beside}
        if hypothesis == B:
            return member(B, 100.0, "own" if (C, "") in forms else "late")
        if hypothesis == A:
            return member(A, 100.0)
        return member(C, 160.0 if (B, "own") in forms else 80.0)

    def accepted(problem, groups) -> SimpleNamespace:
        return SimpleNamespace(gain=together if (B, "own") in {g.form for g in groups} else 200.0)

    def others(problem, members, i) -> tuple[SimpleNamespace, ...]:
        return tuple(m.group for k, m in enumerate(members) if k != i)

    for name, value in {
        "accept_all_but": others,
        "with_total_torque": lambda problem, members, hypotheses: problem,
        "refine": refined,
        "remeasure": lambda problem, m, beside: m,
        "scan": lambda *args: None,
        "screen_candidates": lambda *args: [SimpleNamespace(hypothesis=C, shape=())],
        "_refined": lambda starts, beside: [refined(*start, beside) for start in starts],
        "_acts_on": lambda problem, hypothesis: (0, 1),
    }.items():
        monkeypatch.setattr(swap_search, name, value)
    monkeypatch.setattr(fitted_effects, "accept", accepted)
    members, _ = swap_search.refine_with_swaps(
        SimpleNamespace(rows=1000),  # type: ignore[arg-type]
        [],
        [member(A, 100.0), member(B, 100.0, "late")],  # type: ignore[list-item]
        [0.0, 0.0],
        set(),
        {A: 100.0, B: 100.0},
        0.01,
    )
    assert [m.hypothesis for m in members] == chosen

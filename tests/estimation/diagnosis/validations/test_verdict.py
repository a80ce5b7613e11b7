"""Specification of the verdict: names beside free functions in their place."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from estimation.diagnosis.hypothesis_tests.hypotheses import Hypothesis
from estimation.diagnosis.hypothesis_tests.refinement import FittedEffect
from estimation.diagnosis.searches.selection import SelectedEffect
from estimation.diagnosis.validations import comparison, verdict
from robots.terms.discrepancies.local_fault import LocalFault
from robots.terms.discrepancies.patterns import Pattern
from robots.terms.discrepancies.payload_drift import PayloadDrift
from tests.estimation.diagnosis.verdict_bench import PRICE, ROWS, accepting, member_of


@pytest.mark.parametrize(
    ("free", "left", "holds"),
    [
        (400.0, 40.0, False),  # one free function explains what ripple and push do: the push was the ripple's rest
        (400.0, 95.0, True),  # the push is there all the same
        (310.0, 40.0, True),  # the free function explains less than the two, all parameters counted
    ],
)
def test_a_name_of_the_whole_robot_may_be_what_a_name_on_a_joint_left(
    free: float, left: float, holds: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A ripple of a gain of 300 and a push of 100 beside it, of 4 and 6 parameters."""
    ripple, push = member_of("torque_ripple", 1, 300.0, 4), member_of("external_contact", None, 100.0, 6)
    gains = {(): 0.0, ("external_contact",): 100.0, ("external_contact", "torque_ripple"): 400.0}
    gains["torque_ripple", "external_contact"] = 400.0
    labels = {id(m.group): m.hypothesis.name for m in (ripple, push)}
    accepting(
        monkeypatch,
        lambda problem, groups: SimpleNamespace(gain=gains.get(tuple(labels.get(id(g), "free") for g in groups), 0.0)),
    )
    monkeypatch.setattr(comparison, "score", lambda problem, group, beside: SimpleNamespace(gain=left))
    found = replace(ripple, gain=free, degrees=8, group=replace(ripple.group))
    monkeypatch.setattr(verdict, "free_functions", lambda *arguments: ([found] if push not in arguments[2] else [], []))
    problem = SimpleNamespace(rows=ROWS)
    assert verdict._explains_joint(problem, 1, [ripple, push], [], [], 0.01) is holds  # type: ignore[arg-type]
    assert (free - 8 * PRICE < 400.0 - 10 * PRICE) is (free == 310.0)


@pytest.mark.parametrize(
    ("spot", "degrees", "name", "holds"),
    [
        (280.0, 3, "torque_ripple", False),  # a catch at one angle explains what five parameters of waves do
        (260.0, 3, "torque_ripple", True),  # the waves explain more than the catch
        (280.0, 5, "torque_ripple", True),  # as many parameters are no less
        (280.0, 3, "spring", True),  # a spring does not go up and down
    ],
)
def test_waves_are_no_catch_at_one_angle(
    spot: float, degrees: int, name: str, holds: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A ripple of a gain of 300 and five parameters, beside a spot of the joint's range in its place."""
    own = member_of(name, 1, 300.0, 5)
    catch = replace(member_of("spring", 1, spot, degrees), hypothesis=Hypothesis(LocalFault(), 1))
    gains = {id(own.group): 300.0, id(catch.group): spot}
    accepting(monkeypatch, lambda problem, groups: SimpleNamespace(gain=sum(gains[id(g)] for g in groups)))
    spots = [SimpleNamespace(hypothesis=catch.hypothesis), SimpleNamespace(hypothesis=Hypothesis(Pattern("turns"), 1))]

    def patterns(
        problem: object, entries: list[SimpleNamespace], *rest: object
    ) -> tuple[list[FittedEffect], list[float]]:
        # Among all free functions another one comes first: that of most parameters.
        wide = replace(member_of("spring", 1, 250.0, 9), hypothesis=Hypothesis(Pattern("turns"), 1))
        return [wide if len(entries) > 1 else catch], []

    monkeypatch.setattr(verdict, "free_functions", patterns)
    problem = SimpleNamespace(rows=ROWS)
    assert verdict._explains_joint(problem, 1, [own], spots, [], 0.01) is holds  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("free", "elsewhere", "holds"),
    [
        (78.0, 1.0, True),  # no more is seen of the tilt than of the drift, and it fits little better
        (78.0, 12.0, False),  # it is seen on another joint, too
        (92.0, 1.0, False),  # it fits far better
    ],
)
def test_a_cause_of_all_joints_is_told_by_more_than_the_joint_of_a_name(
    free: float, elsewhere: float, holds: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A drift of the first joint, of a gain of 80 and four parameters, or a base that tilts, of three."""
    drift = member_of("torque_sensor_drift", 1, 80.0, 4)
    columns = tuple(np.sqrt(x / ROWS) * np.ones((ROWS, 1), np.float32) for x in (free - elsewhere, elsewhere))
    tilt = replace(member_of("base_tilt", None, free, 3), group=replace(drift.group, joints=(0, 1), columns=columns))
    gains = {id(drift.group): 80.0, id(tilt.group): free}
    accepting(monkeypatch, lambda problem, groups: SimpleNamespace(gain=sum(gains[id(g)] for g in groups)))
    monkeypatch.setattr(verdict, "free_functions", lambda *arguments: ([tilt], []))
    problem = SimpleNamespace(rows=ROWS)
    assert verdict._better_than_one_cause(problem, [drift], [], 0.01) is holds  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("degrees", "of_time", "holds"),
    [
        (3, False, False),  # a function of the motion explains as much with three parameters as the drift with 16
        (16, False, True),  # with as many parameters it is no better
        (3, True, True),  # a function of time is what a drift is
    ],
)
def test_a_drift_is_a_free_function_of_time(
    degrees: int, of_time: bool, holds: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A zero that wanders over a gain of 220 beside a pattern of 219, of the joint's angle or of time."""
    drift = member_of("torque_sensor_drift", 2, 220.0, 16)
    pattern = Hypothesis(Pattern("time" if of_time else "angle"), 2)
    free = replace(member_of("spring", 2, 219.0, degrees), hypothesis=pattern)
    gains = {id(drift.group): 220.0, id(free.group): 219.0}
    accepting(monkeypatch, lambda problem, groups: SimpleNamespace(gain=sum(gains[id(g)] for g in groups)))

    def patterns(
        problem: object, entries: list[SimpleNamespace], *rest: object, **kind: bool
    ) -> tuple[list[FittedEffect], list[float]]:
        return ([free] if entries else []), []

    monkeypatch.setattr(verdict, "free_functions", patterns)
    problem = SimpleNamespace(rows=ROWS)
    entries = [SimpleNamespace(hypothesis=pattern)]
    assert verdict._explains_joint(problem, 2, [drift], entries, [], 0.01) is holds  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("joints", "where", "left", "kept"),
    [
        ((0, 1), 2, 10.0, False),  # without it a free function on the other joint explains nearly all that it does
        ((0, 1), 2, 90.0, True),  # it explains something else
        ((0,), 2, 10.0, False),  # it acts on its own joint alone, but base parameters had taken the other's for it
        ((0,), 2, 90.0, True),  # it does nothing on the other joint
        ((0,), None, 10.0, False),  # something swings, and moves all joints
        ((0,), None, 90.0, True),
    ],
)
def test_a_formula_is_not_named_for_what_is_unexplained_on_joints_that_it_reaches(
    joints: tuple[int, ...], where: int | None, left: float, kept: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An encoder's offset of a gain of 100 beside a pattern of 80 on joint 2, or on all."""
    offset = member_of("encoder_offset", 1, 100.0, 1)
    offset = replace(offset, group=replace(offset.group, joints=joints))
    free = replace(member_of("spring", 2, 80.0, 15), hypothesis=Hypothesis(Pattern("angle"), where))
    gains = {id(offset.group): 100.0, id(free.group): 80.0}
    accepting(monkeypatch, lambda problem, groups: SimpleNamespace(gain=sum(gains[id(g)] for g in groups)))
    monkeypatch.setattr(comparison, "score", lambda problem, group, beside: SimpleNamespace(gain=left))
    monkeypatch.setattr(verdict, "free_functions", lambda *arguments, **kind: ([free], [1e-30]))
    monkeypatch.setattr(verdict, "_explains_joint", lambda *arguments: True)
    monkeypatch.setattr(verdict, "_is_plausible", lambda *arguments: True)
    found = SelectedEffect(offset, 1e-9, ())
    selection = SimpleNamespace(found=(found,), accepted=SimpleNamespace(gain=100.0))
    said = verdict.decide_verdict(SimpleNamespace(rows=ROWS), selection, [], 0.01)  # type: ignore[arg-type]
    assert said.verdict == "unexplained"
    assert said.patterns == (free,)
    assert said.named == ((found,) if kept else ())


@pytest.mark.parametrize(
    ("free", "degrees", "holds"),
    [
        (620.0, 6, False),  # a function of one joint's motion explains clearly more, and is worth its parameters
        (620.0, 40, True),  # it explains that much with far more of them
        (550.0, 6, True),  # it is better, but formulas are not exact: not by enough
        (900.0, 90, False),  # whatever it costs, the name leaves a third of it
    ],
)
def test_a_name_of_the_whole_robot_is_weighed_against_functions_of_a_joint(
    free: float, degrees: int, holds: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A tilted base of a gain of 500 and two parameters, named for what happens on one joint."""
    tilt = member_of("base_tilt", None, 500.0, 2)
    pattern = Hypothesis(Pattern("drag", 3), 1)
    other = replace(member_of("spring", 1, free, degrees), hypothesis=pattern)
    monkeypatch.setattr(verdict, "free_functions", lambda *arguments, **kind: ([other], [1e-30]))
    found = SelectedEffect(tilt, 1e-9, ())
    problem = SimpleNamespace(rows=ROWS)
    held = verdict._outperforms_free_functions(problem, found, [tilt], [], 0.01)  # type: ignore[arg-type]
    assert held is holds


def test_several_names_on_one_joint_must_fit_better_than_one_free_function(monkeypatch: pytest.MonkeyPatch) -> None:
    """A spring and a presliding of 309 together are a cable that relaxes, if that explains as much by itself."""
    pair = [member_of("spring", 1, 200.0, 3), member_of("presliding_hysteresis", 1, 109.0, 2)]
    free = replace(member_of("spring", 1, 299.0, 4), hypothesis=Hypothesis(Pattern("memory"), 1))
    gains = {id(pair[0].group): 200.0, id(pair[1].group): 109.0, id(free.group): 299.0}
    accepting(monkeypatch, lambda problem, groups: SimpleNamespace(gain=sum(gains[id(g)] for g in groups)))
    problem = SimpleNamespace(rows=ROWS)

    def held(functions: list[FittedEffect]) -> bool:
        monkeypatch.setattr(verdict, "free_functions", lambda *arguments, **kind: (functions, []))
        return verdict._explains_joint(problem, 1, pair, [], [], 0.01)  # type: ignore[arg-type]

    assert 309.0 - 5 * PRICE - (299.0 - 4 * PRICE) < verdict.LEAST
    assert not held([free])
    assert held([replace(free, gain=280.0)])


@pytest.mark.parametrize(
    ("gains", "stays"), [((300.0, 250.0, 250.0), True), ((490.0, 450.0), False), ((600.0,), False)]
)
def test_what_does_more_than_free_functions_does_not_borrow_from_them(
    gains: tuple[float, ...], stays: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A delay of a gain of 1000, of which ringing joints imitate more than it keeps beside them."""
    delay = member_of("time_delay", None, 1000.0, 2)
    free = [
        replace(member_of("spring", k, gain, 5), hypothesis=Hypothesis(Pattern("ringing"), k))
        for k, gain in enumerate(gains, start=1)
    ]
    monkeypatch.setattr(verdict, "free_functions", lambda *arguments, **kind: (free, []))
    accepting(monkeypatch, lambda problem, groups: SimpleNamespace(gain=1000.0 * len(groups)))
    monkeypatch.setattr(comparison, "score", lambda problem, group, beside: SimpleNamespace(gain=450.0))
    found = SelectedEffect(delay, 1e-9, ())
    problem: Any = SimpleNamespace(rows=ROWS)
    assert verdict._is_robust(problem, found, (found,), [], 0.01) is stays


def test_small_names_beside_one_that_holds_are_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    """Three names on a joint are beaten by free functions; the strongest by itself is not: the others were its rest."""
    stribeck, spring, push = (
        member_of("stribeck", 3, 700.0, 3),
        member_of("spring", 3, 90.0, 4),
        member_of("spring", 2, 9.0, 4),
    )
    seen: list[tuple[str, ...]] = []

    def holds(problem: object, joint: int, named: list[FittedEffect], *rest: object) -> bool:
        seen.append(tuple(m.hypothesis.label for m in named if m.hypothesis.joint == joint))
        return len(seen[-1]) == 1

    accepting(monkeypatch, lambda problem, groups: SimpleNamespace(gain=800.0))
    monkeypatch.setattr(verdict, "free_functions", lambda *arguments, **kind: ([], []))
    monkeypatch.setattr(verdict, "refine", lambda problem, hypothesis, shape, beside: replace(stribeck, gain=705.0))
    monkeypatch.setattr(verdict, "_explains_joint", holds)
    monkeypatch.setattr(verdict, "_is_plausible", lambda *arguments: True)
    found = tuple(SelectedEffect(member, 1e-9, ()) for member in (stribeck, spring, push))
    selection = SimpleNamespace(found=found, accepted=SimpleNamespace(gain=800.0))
    said = verdict.decide_verdict(SimpleNamespace(rows=ROWS), selection, [], 0.01)  # type: ignore[arg-type]
    assert said.verdict == "named"
    assert [(f.effect.hypothesis.label, f.effect.gain) for f in said.named] == [
        ("stribeck of joint 3", 705.0),
        ("spring of joint 2", 9.0),
    ]
    assert seen == [("spring of joint 2",), ("stribeck of joint 3", "spring of joint 3"), ("stribeck of joint 3",)]


@pytest.mark.parametrize(("gain", "holds"), [(526.0, False), (480.0, True)])
def test_a_tank_that_empties_is_no_step(gain: float, holds: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """A step of 468 and five parameters, where a body that changes slowly explains clearly more with twelve."""
    step = member_of("payload_change", None, 468.0, 5)
    drains = replace(member_of("spring", None, gain, 12), hypothesis=Hypothesis(PayloadDrift(), None))
    entry = SimpleNamespace(hypothesis=drains.hypothesis)

    def free(problem: object, patterns: list[Any], *rest: object) -> tuple[list[FittedEffect], list[float]]:
        return ([drains], [1e-30]) if patterns else ([], [])

    monkeypatch.setattr(verdict, "free_functions", free)
    problem = SimpleNamespace(rows=ROWS)
    found = SelectedEffect(step, 1e-9, ())
    held = verdict._outperforms_free_functions(problem, found, [step], [entry], 0.01)  # type: ignore[arg-type,list-item]
    assert held is holds

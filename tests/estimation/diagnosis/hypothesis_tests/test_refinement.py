"""Tests of the BIC penalty by the rows in which an effect acts, and of the refinement of shapes."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from estimation.diagnosis.calibration import MIN_BIC_GAIN, RARE_ODDS
from estimation.diagnosis.hypothesis_tests import refinement
from estimation.diagnosis.hypothesis_tests.fitted_effects import FittedEffect
from estimation.diagnosis.hypothesis_tests.hypotheses import Hypothesis
from estimation.diagnosis.hypothesis_tests.joint_agreement import PerJointEvidence
from estimation.diagnosis.hypothesis_tests.problem import Group
from estimation.diagnosis.hypothesis_tests.scan import Outcome
from estimation.diagnosis.hypothesis_tests.scoring import Limited
from estimation.diagnosis.searches import acceptance
from estimation.diagnosis.searches.acceptance import SURE, exceeds_leakage, is_certain, passes_bic
from estimation.diagnosis.searches.swap_search import screen_candidates
from robots.terms.effects import EFFECTS, Shape
from robots.terms.effects.stribeck import Stribeck

ROWS, ACTING = 5000, 40
GAIN, DEGREES = 300.0, 3


def _member(name: str, joint: int | None, columns: tuple[np.ndarray, ...]) -> FittedEffect:
    k = columns[0].shape[1]
    small = tuple(part.astype(np.float32) for part in columns)
    group = Group(tuple(range(len(columns))), small, np.zeros((k, 1)), np.eye(k), np.ones(k), np.ones(k))
    return FittedEffect(Hypothesis(EFFECTS[name], joint), (), group, GAIN, np.ones(k), DEGREES, 1.0)


def _boxes(size: float = 1.0) -> tuple[np.ndarray, ...]:
    """Returns a column of `ACTING` equal rows on each of two joints, like a short contact."""
    columns = np.zeros((2, ROWS, 2))
    for j in range(2):
        columns[j, 100 : 100 + ACTING, j] = size
    return tuple(columns)


def _price(member: FittedEffect) -> float:
    """Computes the penalty per degree of freedom."""
    return (GAIN - member.local_bic_gain) / DEGREES


@pytest.mark.parametrize("size", [1.0, 0.02, 300.0])
def test_a_contact_is_paid_for_by_the_rows_it_acts_on(size: float) -> None:
    """A transient effect that acts in m of N rows has the penalty log m per degree, for any size."""
    assert _price(_member("external_contact", None, _boxes(size))) == pytest.approx(np.log(ACTING), rel=1e-6)


def test_a_lasting_effect_is_paid_for_by_all_rows_of_its_joints() -> None:
    """A permanent effect with the same columns has the penalty log(N joints), because rows with zeros count, too."""
    assert _price(_member("base_tilt", None, _boxes())) == pytest.approx(np.log(2 * ROWS))
    assert _price(_member("spring", 1, _boxes()[:1])) == pytest.approx(np.log(ROWS))


def test_a_passing_effect_that_acts_at_all_times_costs_no_more_than_a_lasting_one() -> None:
    """A transient effect that acts in all rows, or in none, has the penalty of a permanent one."""
    for value in (1.0, 0.0):
        columns = np.full((2, ROWS, 1), value)
        assert _price(_member("external_contact", None, tuple(columns))) == pytest.approx(np.log(2 * ROWS))


def test_columns_of_different_length_cost_their_mean_and_two_rows_at_least() -> None:
    """The number of rows is the mean over the columns, and at least two, because log 1 would be no penalty."""
    columns = np.zeros((1, ROWS, 2))
    columns[0, :20, 0] = columns[0, 200:260, 1] = 1.0
    assert _price(_member("external_contact", None, tuple(columns))) == pytest.approx(np.log(40))
    spike = np.zeros((1, ROWS, 1))
    spike[0, 7] = 1.0
    assert _price(_member("external_contact", None, tuple(spike))) == pytest.approx(np.log(2))


def test_a_rare_effect_has_to_explain_more() -> None:
    """A rare effect has an additional penalty."""
    columns = _boxes()[:1]
    difference = _member("stribeck", 1, columns).local_bic_gain - _member("load_stribeck", 1, columns).local_bic_gain
    assert difference == pytest.approx(RARE_ODDS)


def test_a_push_leaves_other_rows_alone() -> None:
    """The share of a permanent effect beside a contact is the fraction of rows; it is one beside itself."""
    push = _member("external_contact", None, _boxes())
    always = _member("base_tilt", None, tuple(np.ones((2, ROWS, 1))))
    assert always.share_beside(push, 0) == pytest.approx(ACTING / ROWS)
    assert push.share_beside(always, 0) == pytest.approx(1.0)
    assert push.share_beside(push, 1) == pytest.approx(1.0)
    assert push.share_beside(_member("spring", 1, _boxes()[:1]), 1) == 0.0


def test_what_errors_of_the_motion_may_make_of_a_gain_says_nothing_of_its_being_there() -> None:
    """The part of a gain that motion errors may cause counts for acceptance, but not in the local BIC gain."""
    delay = _member("time_delay", None, _boxes())
    doubted = replace(delay, motion_error_chi2=GAIN - 40.0)
    assert doubted.bic_gain == delay.bic_gain
    assert doubted.local_bic_gain == pytest.approx(delay.local_bic_gain - GAIN + 40.0)
    for others in ([], [_member("spring", 1, _boxes()[:1])]):
        assert passes_bic(delay, others)
        assert not passes_bic(replace(doubted, degrees=4), others)


def test_a_contact_that_cannot_win_is_not_searched() -> None:
    """A transient effect is not refined if twice its gain, minus its penalty, is below the best hypothesis.

    Permanent effects are always refined.
    """

    def outcome(name: str, joint: int | None, gain: float, degrees: int) -> Outcome:
        return Outcome(Hypothesis(EFFECTS[name], joint), (), gain, 1.0, gain / 2, degrees)

    situation = SimpleNamespace(t=np.array([0.0, 60.0]), robot=SimpleNamespace(n=2))
    problem = SimpleNamespace(rows=ROWS, situation=situation, state_for=lambda effect: situation)
    best = outcome("asymmetric_friction", 1, 400.0, 3)
    # Six coefficients; start, duration and hardness of a contact are fitted, too.
    weak, strong = (outcome("external_contact", None, gain, 6) for gain in (215.0, 250.0))
    lasting = outcome("stribeck", 1, 180.0, 1)

    def chosen(*outcomes: Outcome) -> set[str]:
        scanned = SimpleNamespace(outcomes=outcomes)
        return {o.hypothesis.name for o in screen_candidates(problem, scanned)}  # type: ignore[arg-type]

    assert chosen(best, weak, lasting) == {"asymmetric_friction", "stribeck"}
    assert chosen(best, strong, lasting) == {"asymmetric_friction", "external_contact", "stribeck"}
    assert chosen(weak) == {"external_contact"}


def test_what_a_log_shows_by_itself_is_no_leftover() -> None:
    """Beside an effect of fifty times its gain, a further effect counts only if it is clipping with flat tops."""
    rng = np.random.default_rng(5)
    tau = rng.normal(size=(ROWS, 2))
    flat = np.clip(tau, -1.0, 1.0)
    large = replace(_member("asymmetric_friction", 1, (tau[:, :1],)), gain=1e4)
    small = _member("current_clipping", 1, ((flat - tau)[:, :1],))
    other = _member("stribeck", 1, ((flat - tau)[:, :1],))

    def counts(candidate: FittedEffect, measured: np.ndarray) -> bool:
        situation = SimpleNamespace(runs=(slice(0, ROWS),), robot=None, measured=None)
        problem = SimpleNamespace(situation=situation, recording=SimpleNamespace(tau=measured), rows=ROWS)
        return exceeds_leakage(problem, replace(candidate, gain=200.0), [large])  # type: ignore[arg-type]

    assert counts(small, flat)
    assert not counts(small, tau)
    assert not counts(other, flat)


@pytest.mark.parametrize(
    ("beside", "chance", "gain", "sure"),
    [
        ((), 0.5, 25.0, True),
        ((1,), 0.5, 25.0, False),  # the other effect's formula error on this joint may be as large
        ((2,), 0.5, 25.0, True),
        ((2,), 2.0, 25.0, False),  # by chance that often
        ((2,), 0.5, 10.0, False),  # not worth its parameters
        ((2, None), 0.5, 25.0, False),  # a contact acts on all joints
    ],
)
def test_what_is_far_from_chance_is_sure_on_a_joint_of_its_own(
    beside: tuple[int | None, ...], chance: float, gain: float, sure: bool
) -> None:
    """An effect is certain without a BIC gain of 10 if its p-value is low and no other effect acts on its joint."""
    rng = np.random.default_rng(7)

    def on(joint: int | None) -> FittedEffect:
        name, column = ("external_contact" if joint is None else "stribeck"), rng.normal(size=(ROWS, 1))
        member = _member(name, joint, (column, column) if joint is None else (column,))
        return replace(member, group=replace(member.group, joints=(0, 1) if joint is None else (joint - 1,)))

    own = replace(on(1), gain=gain, degrees=2)
    assert own.bic_gain < MIN_BIC_GAIN
    problem: Any = SimpleNamespace(rows=ROWS)
    assert is_certain(problem, own, chance * SURE * 0.01, [on(joint) for joint in beside], 0.01) is sure


@pytest.mark.parametrize(
    ("gains", "other", "counts"),
    [
        ((500.0, 1.0), 1000.0, False),  # only what the other effect leaves on its joint
        ((500.0, 80.0), 1000.0, True),  # the second joint alone supports it
        ((500.0, 400.0), 100.0, True),  # both do
        ((500.0, 1.0), 0.0, False),  # the joints contradict each other
    ],
)
def test_what_all_joints_share_is_reported_by_those_without_a_stronger_effect(
    gains: tuple[float, float], other: float, counts: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A shared coefficient counts beside a stronger effect on one joint only if the other joint supports it."""
    rng = np.random.default_rng(6)
    column = rng.normal(size=(ROWS, 1))
    delay = replace(_member("time_delay", None, (column, column)), gain=sum(gains))
    ripple = replace(_member("torque_ripple", 1, (column,)), gain=other)
    gram = np.array([1e4, 1e4])
    reported = PerJointEvidence(gram, np.sqrt(np.array(gains) * gram), np.ones(2), np.zeros(2))
    monkeypatch.setattr(acceptance, "accept", lambda problem, groups: None)
    monkeypatch.setattr(acceptance, "per_joint_evidence", lambda *_: reported)
    situation = SimpleNamespace(runs=(slice(0, ROWS),), robot=None)
    problem = SimpleNamespace(situation=situation, recording=SimpleNamespace(tau=column), rows=ROWS)
    assert exceeds_leakage(problem, delay, [ripple]) is counts  # type: ignore[arg-type]


class _Summits(Stribeck):
    """An effect with one shape parameter and a given list of other optima."""

    shapes = (Shape("place", "rad", 1e-4, 1.0, "log", (0.08,)),)

    def __init__(self, far: bool) -> None:
        self.far = far

    def likely(self, *_: object) -> tuple[tuple[float | None, ...], ...]:
        return ()

    def other_optima(self, *_: object) -> tuple[tuple[tuple[float, ...], ...], ...]:
        # One start is too far from the other optimum, and one is near it.
        return (((0.02,), (0.0013,)),) if self.far else ()


@pytest.mark.parametrize(("far", "expected"), [(False, 0.1), (True, 0.001)])
def test_a_search_starts_again_from_other_summits(far: bool, expected: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """The search finds the better of two narrow optima only from a start near it."""

    def score(problem: object, shape: tuple[float, ...], accepted: object) -> SimpleNamespace:
        at = float(np.log10(shape[0]))
        gain = 50 * np.exp(-0.5 * ((at + 1) / 0.3) ** 2) + 80 * np.exp(-0.5 * ((at + 3) / 0.3) ** 2)
        return SimpleNamespace(limited=lambda *_: Limited(float(gain), np.ones(1), 1), visible=1.0)

    monkeypatch.setattr(refinement, "score", score)
    monkeypatch.setattr(Hypothesis, "coefficient_bounds", lambda *_: ((-np.inf, np.inf),))
    group = replace(_member("stribeck", 1, (np.ones((ROWS, 1)),)).group)

    class _Shape(tuple):  # type: ignore[type-arg]
        joints, columns = group.joints, (np.zeros((ROWS, 1)),)

    situation = SimpleNamespace(robot=None)
    problem = SimpleNamespace(state_for=lambda _: situation, rows=ROWS, measured=lambda _, shape: _Shape(shape))
    effect = _Summits(far)
    member = refinement.refine(problem, Hypothesis(effect, 1), (0.08,), None)  # type: ignore[arg-type]
    assert member.shape[0] == pytest.approx(expected, rel=0.05)


class _More(Stribeck):
    """An effect with an optional shape parameter."""

    shapes = (
        Shape("place", "rad", 1e-4, 1.0, "log", (0.08,)),
        Shape("more", "", 0.0, 2.0, "linear", (0.0,), default=0.0, beside=True),
    )

    def likely(self, *_: object) -> tuple[tuple[float | None, ...], ...]:
        return ()

    def other_optima(self, *_: object) -> tuple[tuple[tuple[float, ...], ...], ...]:
        return ()


@pytest.mark.parametrize(("brings", "place", "more", "degrees"), [(5.0, 0.1, 0.0, 2), (60.0, 0.03, 1.0, 3)])
def test_what_an_effect_is_whole_without_is_a_parameter_only_where_it_pays(
    brings: float, place: float, more: float, degrees: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An optional shape parameter is fitted if its gain exceeds the penalty ln 5000 = 8.5, else it is unused."""

    def score(problem: object, shape: tuple[float, ...], accepted: object) -> SimpleNamespace:
        top = -1.0 + shape[1] * (np.log10(0.03) + 1.0)
        gain = 100 - 400 * (np.log10(shape[0]) - top) ** 2 + brings * (1 - (shape[1] - 1) ** 2)
        return SimpleNamespace(limited=lambda *_: Limited(float(gain), np.ones(1), 1), visible=1.0)

    monkeypatch.setattr(refinement, "score", score)
    monkeypatch.setattr(Hypothesis, "coefficient_bounds", lambda *_: ((-np.inf, np.inf),))

    class _Shape(tuple):  # type: ignore[type-arg]
        joints, columns = (0,), (np.zeros((ROWS, 1)),)

    situation = SimpleNamespace(robot=None)
    problem = SimpleNamespace(state_for=lambda _: situation, rows=ROWS, measured=lambda _, shape: _Shape(shape))
    member = refinement.refine(problem, Hypothesis(_More(), 1), (0.08, 0.0), None)  # type: ignore[arg-type]
    assert member.shape == (pytest.approx(place, rel=0.05), pytest.approx(more, abs=0.05))
    assert member.degrees == degrees


@pytest.mark.parametrize(("best", "worth"), [(1e-6, False), (4e-5, True)])
def test_friction_that_turns_round_over_no_way_is_no_presliding(
    best: float, worth: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Presliding whose best travel is below the lower bound resembles a delay, so its gain does not count."""

    def score(problem: object, shape: tuple[float, ...], accepted: object) -> SimpleNamespace:
        gain = 300 - 10 * np.log(shape[0] / best) ** 2
        return SimpleNamespace(limited=lambda *_: Limited(float(gain), np.ones(1), 1), visible=1.0)

    monkeypatch.setattr(refinement, "score", score)
    monkeypatch.setattr(Hypothesis, "coefficient_bounds", lambda *_: ((0.0, np.inf),))

    class _Shape(tuple):  # type: ignore[type-arg]
        joints, columns = (0,), (np.zeros((ROWS, 1)),)

    situation = SimpleNamespace(robot=None)
    problem = SimpleNamespace(state_for=lambda _: situation, rows=ROWS, measured=lambda _, shape: _Shape(shape))
    presliding = Hypothesis(EFFECTS["presliding_hysteresis"], 1)
    member = refinement.refine(problem, presliding, (1e-4,), None)  # type: ignore[arg-type]
    assert (member.bic_gain > 100.0) is worth
    assert (member.local_bic_gain > 100.0) is worth

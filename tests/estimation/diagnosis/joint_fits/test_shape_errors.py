"""Tests of the standard errors of shape parameters."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from estimation.diagnosis.hypothesis_tests.hypotheses import Hypothesis
from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.hypothesis_tests.refinement import refine
from estimation.diagnosis.hypothesis_tests.scoring import accept, score
from estimation.diagnosis.joint_fits.shape_errors import (
    CUT,
    _reach,
    shape_errors,
    spread_over_pauses,
    widen_change_times,
)
from estimation.diagnosis.recordings.log_reading import build_recording
from robots.common.stretches import spans
from robots.robot import Robot
from robots.signals import Log
from robots.terms.effects import EFFECTS

STRIBECK = Hypothesis(EFFECTS["stribeck"], 1)
SPEED, EXPONENT = 0.25, 1.5
BOUND = 3.84  # of twice the logarithm of the likelihood ratio: 95 %


@pytest.mark.slow
@pytest.mark.parametrize("size", [1.6, 2.5])
def test_a_velocity_is_as_uncertain_as_its_exponent_lets_it_be(
    arm: Robot, arm_log: Callable[..., Log], pose_arm: Callable[..., Problem], size: float
) -> None:
    """A Stribeck velocity's interval is that of the profile likelihood, wider than with a fixed exponent."""
    recording = build_recording(arm, [arm_log(torque_noise=0.02)])
    extra = np.zeros_like(recording.tau)
    speed = np.abs(recording.dq[:, 0])
    extra[:, 0] = size * np.exp(-((speed / SPEED) ** EXPONENT)) * np.sign(recording.dq[:, 0])
    problem = pose_arm(replace(recording, tau=recording.tau + extra))
    nothing = accept(problem, ())
    member = refine(problem, STRIBECK, (0.2, 1.0), nothing)
    velocity = member.shape[0]
    velocities = velocity * np.exp(np.linspace(-1.0, 1.0, 81))
    exponents = np.linspace(0.5, 2.5, 21)
    gains = np.array(
        [[score(problem, problem.measured(STRIBECK, (v, d)), nothing).gain for d in exponents] for v in velocities]
    )
    profile, held = gains.max(axis=1), gains[:, np.argmin(np.abs(exponents - member.shape[1]))]
    wanted, narrow = (
        np.abs(np.log(velocities[curve.max() - curve < BOUND] / velocity)).max() for curve in (profile, held)
    )
    reported = 1.959964 * shape_errors(problem, member, nothing)[0] / velocity
    assert reported == pytest.approx(wanted, abs=0.03)
    assert reported > 1.2 * narrow
    assert abs(np.log(velocity / SPEED)) < reported


@pytest.mark.slow
@pytest.mark.parametrize(("share", "reported"), [(0.0, True), (1.0, True), (0.0, False)])
def test_a_choice_is_reported_where_the_other_explains_less(
    arm: Robot, arm_log: Callable[..., Log], pose_arm: Callable[..., Problem], share: float, reported: bool
) -> None:
    """The choice between load and motor torque has no error if the data determine it, and an infinite one if not."""
    recording = build_recording(arm, [arm_log(torque_noise=0.02)])
    ripple = Hypothesis(EFFECTS["torque_ripple"], 1)
    now = pose_arm(recording).situation
    X = ripple.effect.columns(now, 1, (40.0, 0.0, share))
    coefficients = np.array([0.02, 0.0, 0.2, 0.1]) if reported else np.array([0.5, 0.3, 0.0, 0.0])
    problem = pose_arm(replace(recording, tau=recording.tau + X @ coefficients))
    member = refine(problem, ripple, (40.0, 0.0, 0.0), accept(problem, ()))
    error = shape_errors(problem, member, accept(problem, ()))[2]
    assert error == (0.0 if reported else np.inf)
    if reported:
        assert member.shape[2] == share


@pytest.mark.slow
def test_a_moment_while_the_drive_is_at_its_limit_may_be_anywhere_there(
    arm: Robot, arm_log: Callable[..., Log], pose_arm: Callable[..., Problem]
) -> None:
    """A change time while the same joint's torque is clipped has an interval over the whole clipping."""
    recording = build_recording(arm, [arm_log(torque_noise=0.02)])
    tau = recording.tau.copy()
    level = float(np.quantile(np.abs(tau[:, 0]), 0.8))
    tau[:, 0] = np.clip(tau[:, 0], -level, level)
    problem = pose_arm(replace(recording, tau=tau))
    nothing = accept(problem, ())
    limit = refine(problem, Hypothesis(EFFECTS["current_clipping"], 1), (level,), nothing)
    away = np.flatnonzero(np.abs(tau[:, 0]) < 0.5 * level)
    loss = np.abs(problem.columns_of(limit.hypothesis, limit.shape)[1][0][:, 0])
    start, stop = max(spans(loss > CUT * loss.max()), key=lambda span: span[1] - span[0])
    begins, ends = recording.t[start], recording.t[stop - 1]
    assert ends - begins > 0.2
    step = refine(
        problem, Hypothesis(EFFECTS["friction_step"], 1), (float(recording.t[away[len(away) // 2]]),), nothing
    )
    for moment, wanted in (
        (begins + 0.05, ends - begins - 0.05),
        (ends + 0.02, ends + 0.02 - begins),
        (float(recording.t[away[0]]), 1.959964 * 0.01),
    ):
        there = replace(step, shape=(moment,))
        assert 1.959964 * widen_change_times(problem, there, [limit], [0.01])[0] == pytest.approx(wanted)
        other = replace(there, hypothesis=Hypothesis(EFFECTS["friction_step"], 2))
        assert widen_change_times(problem, other, [limit], [0.01]) == [0.01]
        assert widen_change_times(problem, there, [there], [0.01]) == [0.01]


@pytest.mark.slow
def test_a_moment_while_the_arm_stands_may_be_anywhere_there(
    arm: Robot, arm_log: Callable[..., Log], pose_arm: Callable[..., Problem]
) -> None:
    """The start of a contact during rest has an interval over the rest, and so has its duration."""
    recording = build_recording(arm, [arm_log(torque_noise=0.02)])
    stands = recording.sign_unknown.copy()
    stands[1000:1200] = True
    problem = pose_arm(replace(recording, sign_unknown=stands))
    begins, ends = recording.t[1000], recording.t[1199]
    push = refine(
        problem, Hypothesis(EFFECTS["external_contact"], None), (begins + 0.1, 1.0, 0.5, 0.0, 0.0), accept(problem, ())
    )
    there = replace(push, shape=(begins + 0.1, 1.0, 0.5, 0.0, 0.0))
    start, duration, *rest = widen_change_times(problem, there, [], [0.01, 0.02, 0.03, 0.0])
    assert 1.959964 * start == pytest.approx(ends - begins - 0.1)
    assert duration == start
    assert rest == [0.03, 0.0]
    before = replace(push, shape=(begins - 0.2, 1.0, 0.5, 0.0))
    assert widen_change_times(problem, before, [], [0.01, 0.02, 0.03, 0.0]) == [0.01, 0.02, 0.03, 0.0]


@pytest.mark.slow
def test_a_change_between_two_logs_may_have_come_at_any_time_there(
    arm: Robot, arm_log: Callable[..., Log], pose_arm: Callable[..., Problem]
) -> None:
    """The interval of a change between logs contains the pause and rests at its ends."""
    first = arm_log(torque_noise=0.02)
    recording = build_recording(arm, [first, replace(first, t=first.t + 500.0)])
    border = recording.starts[1]
    stands = recording.sign_unknown.copy()
    stands[border : border + 100] = True
    problem = pose_arm(replace(recording, sign_unknown=stands))
    ends, begins = float(recording.t[border - 1]), float(recording.t[border + 99])
    step = refine(problem, Hypothesis(EFFECTS["friction_step"], 1), (begins,), accept(problem, ()))
    for moment in (begins + 0.01, ends - 0.01):
        middle = spread_over_pauses(problem, replace(step, shape=(moment,)), [])
        assert middle.shape[0] == pytest.approx((ends + begins) / 2, abs=0.02)
        (error,) = widen_change_times(problem, middle, [], [0.01])
        assert 1.959964 * error == pytest.approx((begins - ends) / 2, abs=0.02)
    before = replace(step, shape=(ends - 1.0,))
    assert spread_over_pauses(problem, before, []) is before
    # A contact has its own start and end.
    push = refine(
        problem, Hypothesis(EFFECTS["external_contact"], None), (begins, 1.0, 0.5, 0.0, 0.0), accept(problem, ())
    )
    assert spread_over_pauses(problem, push, []) is push


@pytest.mark.parametrize("edge", [0.9, 3.17, 11.0])
def test_a_moment_may_be_as_far_as_the_likelihood_drops_at_once(edge: float) -> None:
    """The interval reaches to a sudden drop of the likelihood, found to 2 %, on either side."""
    for way in (-1, 1):
        reported = _reach(lambda x, way=way: 30.0 if way * x > edge or way * x < -0.3 else 3.0, 0.0, 0.2, (-50.0, 50.0))
        assert reported == pytest.approx(edge, rel=0.02)
    assert _reach(lambda x: 30.0, 0.0, 0.2, (-50.0, 50.0)) == 0.0

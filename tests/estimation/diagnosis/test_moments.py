"""Tests of the search for change times and their intervals, and of delays on which joints must agree."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from estimation.diagnosis.hypothesis_tests.hypotheses import Hypothesis
from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.hypothesis_tests.refinement import refine
from estimation.diagnosis.hypothesis_tests.scoring import accept, score
from estimation.diagnosis.joint_fits import shape_errors as errors
from estimation.diagnosis.joint_fits.extended_fit import fit_extended
from estimation.diagnosis.recordings.log_reading import build_recording
from estimation.diagnosis.recordings.recording import Recording
from robots.robot import Robot
from robots.signals import Log
from robots.terms.effects import EFFECTS
from robots.terms.effects.time_delay import lateness

STEP = Hypothesis(EFFECTS["friction_step"], 2)
DELAY = Hypothesis(EFFECTS["time_delay"], None)
TRUE = 7.31


@pytest.fixture(scope="module")
def recording(arm: Robot, arm_log: Callable[..., Log]) -> Recording:
    """Returns a recording of the arm without effects."""
    return build_recording(arm, [arm_log(torque_noise=0.02)])


@pytest.fixture(scope="module")
def posed(recording: Recording, pose_arm: Callable[..., Problem]) -> Callable[[np.ndarray], Problem]:
    """Returns a function that builds the problem of the log with additional torque (N, 2)."""
    return lambda extra: pose_arm(replace(recording, tau=recording.tau + extra))


def _stepped(recording: Recording, size: float) -> np.ndarray:
    extra = np.zeros_like(recording.tau)
    extra[:, 1] = size * np.sign(recording.dq[:, 1]) * (recording.t >= TRUE)
    return extra


@pytest.mark.slow
@pytest.mark.parametrize("size", [0.1, 0.3])
def test_the_moment_is_the_best_of_all(recording: Recording, posed: Callable, size: float) -> None:
    """From a grid point the search finds a change time at least as good as a scan with steps of 5 ms."""
    problem = posed(_stepped(recording, size))
    nothing = accept(problem, ())
    grid = STEP.effect.grid(problem.situation, STEP.joint)
    start = min((point for point in grid if abs(point[0] - TRUE) > 0.3), key=lambda point: abs(point[0] - TRUE))

    def gain(moment: float) -> float:
        joints, columns = problem.columns_of(STEP, (moment,))
        return score(problem, problem.group(joints, columns), nothing).gain

    best = max(gain(float(moment)) for moment in np.arange(TRUE - 0.6, TRUE + 0.6, 0.005))
    found = refine(problem, STEP, start, nothing)
    assert found.gain >= best - 0.5
    assert abs(found.shape[0] - TRUE) < 0.2


@pytest.mark.slow
def test_intervals_of_a_moment_hold_it(recording: Recording, posed: Callable) -> None:
    """In at least thirteen of sixteen logs with a small step, the 95 % interval contains its time.

    Fewer have a chance of 1e-3. An interval from the likelihood's curvature contains it in half of them.
    """
    held = 0
    for seed in range(16):
        noise = np.random.default_rng(seed).normal(size=recording.tau.shape) * [0.02, 0.06]
        problem = posed(_stepped(recording, 0.06) + noise)
        found = refine(problem, STEP, (TRUE + 0.3,), accept(problem, ()))
        covariance = fit_extended(problem, [found], {}).model.extensions[0].covariance
        held += abs(found.shape[0] - TRUE) <= 1.96 * np.sqrt(covariance[2, 2])
    assert held >= 13


@pytest.mark.slow
def test_joints_must_agree_on_a_delay(recording: Recording, posed: Callable) -> None:
    """A delay of both joints has a BIC gain; opposite delays of both joints have none."""
    plain = posed(np.zeros_like(recording.tau))
    late = 0.006 * lateness(plain.situation, 1e-3)
    both, one = posed(late), posed(late * [1.0, -1.0] * [1.0, 0.5])
    same, apart = (refine(p, DELAY, (0.001,), accept(p, ())) for p in (both, one))
    assert same.coefficients[0] == pytest.approx(0.006, rel=0.4)
    assert same.birge_ratio < 0.1 * same.gain
    assert same.bic_gain > 10
    assert apart.birge_ratio > 10
    assert apart.bic_gain < 0


@pytest.mark.parametrize(("top", "farthest"), [(0.6, 0.55), (1.0, 0.15), (0.0, 1.0)])
def test_a_shape_left_as_assumed_may_be_where_the_likelihood_has_its_top(
    top: float, farthest: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The error of a shape value that was assumed reaches all values whose gain is within 3.84 of the best."""

    def gain(problem: object, member: object, shape: tuple[float, ...], others: object) -> float:
        return 30.0 - ((shape[0] - top) / 0.1) ** 2

    monkeypatch.setattr(errors, "_gain", gain)
    assumed = SimpleNamespace(shape=(1.0,))
    found = errors._assumed(None, assumed, None, gain(None, None, (1.0,), None), (0.0, 1.0))  # type: ignore[arg-type]
    assert found == pytest.approx(farthest)


def test_a_second_summit_belongs_to_the_interval() -> None:
    """The interval of a time includes a second, close maximum of the likelihood, but not a distant one."""

    def drop(value: float) -> float:
        away = abs(value - 7.0)
        if value > 7.0:
            return 8.0 * away / 0.1
        return 14.0 if 0.2 < away < 1.0 else 3.0 if away < 1.6 else 40.0 if away < 6.0 else 0.0

    found = errors._reach(drop, 7.0, 0.02, (0.0, 10.0))
    assert 1.6 / 1.3 <= found <= 1.6 * 1.15
    assert errors._reach(drop, 7.0, 0.02, (6.9, 10.0)) <= 0.1 * 1.15


@pytest.mark.slow
def test_an_interval_is_no_narrower_than_the_profile(recording: Recording, posed: Callable) -> None:
    """The standard error of a time is at least that of the profile likelihood."""
    noise = np.random.default_rng(3).normal(size=recording.tau.shape) * [0.02, 0.06]
    problem = posed(_stepped(recording, 0.06) + noise)
    nothing = accept(problem, ())
    found = refine(problem, STEP, (TRUE + 0.3,), nothing)
    covariance = fit_extended(problem, [found], {}).model.extensions[0].covariance
    assert np.sqrt(covariance[2, 2]) >= 0.999 * errors.shape_errors(problem, found, nothing)[0]


@pytest.mark.slow
@pytest.mark.parametrize("moment", [0.0, 3e-3])
def test_a_lag_of_one_joint_is_reported_no_better_than_its_reversals(
    recording: Recording, posed: Callable, moment: float
) -> None:
    """The local gain of a lag d is bounded by (d / m)^2 for reversal times with an error m."""
    lag, joint = 6e-3, 2
    plain = posed(np.zeros_like(recording.tau))
    problem = posed(lag * lateness(plain.situation, lag) * [0.0, 1.0])
    everywhere, both = np.ones(recording.q.shape, dtype=bool), np.ones(2, dtype=bool)
    known = replace(
        problem.recording,
        sign_known_from_velocity=everywhere,
        trusted=both,
        reversal_time_error=np.full(recording.q.shape, moment),
    )
    found = refine(
        replace(problem, recording=known), Hypothesis(EFFECTS["current_lag"], joint), (lag,), accept(problem, ())
    )
    assert found.gain > 60
    own = score(problem, found.group, accept(problem, ()))
    gram, cross = float(own.gram[0, 0]), float(own.cross[0])
    assert found.motion_error_chi2 == pytest.approx(
        cross**2 / gram * (1 - 1 / (1 + moment**2 * gram)), rel=0.01, abs=1e-9
    )
    assert (found.local_bic_gain > 10) is (moment == 0)

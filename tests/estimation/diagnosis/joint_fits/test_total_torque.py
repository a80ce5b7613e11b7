"""Tests of effects on the total torque: a current limit beside another effect of the same joint."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from estimation.diagnosis.hypothesis_tests.hypotheses import Hypothesis
from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.hypothesis_tests.refinement import refine
from estimation.diagnosis.hypothesis_tests.scoring import accept
from estimation.diagnosis.joint_fits.total_torque import (
    fit_clipped_torque,
    total_torque_from_unclipped,
    with_total_torque,
)
from estimation.diagnosis.recordings.log_reading import build_recording
from estimation.diagnosis.recordings.thinning import keep_clipped_level
from estimation.models.extension import Extension, extension_torque
from robots.robot import Robot
from robots.signals import Log
from robots.terms.effects import EFFECTS
from robots.terms.effects.current_clipping import CurrentClipping

CLIPPING, OTHER = Hypothesis(EFFECTS["current_clipping"], 1), Hypothesis(EFFECTS["asymmetric_friction"], 1)


@pytest.fixture
def hidden(
    arm: Robot, arm_log: Callable[..., Log], pose_arm: Callable[..., Problem]
) -> tuple[Problem, np.ndarray, float]:
    """Returns a problem with asymmetric friction and a torque limit, the true torque (N,), and the limit."""
    recording = build_recording(arm, [arm_log(torque_noise=0.05)])
    plain = pose_arm(recording)
    (_,), (X,) = OTHER.columns(plain.situation, ())
    extra = X @ (3.0 / np.std(X, axis=0))
    tau, true = recording.tau.copy(), plain.situation.torque[:, 0] + extra
    limit = 0.75 * float(np.abs(true).max())
    tau[:, 0] = np.clip(tau[:, 0] + extra, -limit, limit)
    return pose_arm(replace(recording, tau=tau)), true, limit


@pytest.mark.slow
def test_all_of_the_torque_is_known_beside_what_cuts_it_off(hidden: tuple[Problem, np.ndarray, float]) -> None:
    """The total torque is known to 3 % of the clipped part; a base model fitted to the clipped log is not."""
    problem, true, limit = hidden
    flags = CLIPPING.effect.gate(problem.situation, 1, problem.recording.tau)
    other = refine(problem, OTHER, (), accept(problem, ()))
    rough = total_torque_from_unclipped(problem, [other], flags)
    clipping = refine(rough, CLIPPING, (limit,), accept(problem, (other.group,)))
    sharp = fit_clipped_torque(rough, [other, clipping])
    above = np.abs(true) > limit

    def error(torque: np.ndarray) -> float:
        return float(np.sqrt(np.mean((torque - true)[above] ** 2)))

    most = float(np.sqrt(np.mean((np.abs(true) - limit)[above] ** 2)))
    assert sharp.total_torque_state is not None
    assert rough.total_torque_state is not None
    assert error(sharp.total_torque_state.whole[:, 0]) < 0.03 * most
    assert error(rough.total_torque_state.whole[:, 0]) < 0.1 * most
    assert error(problem.situation.torque[:, 0]) > 0.3 * most
    # All torque beyond the limit is lost, and the limit is that of the log.
    again = refine(sharp, CLIPPING, clipping.shape, accept(problem, (other.group,)))
    assert again.shape == (limit,)
    assert again.coefficients[0] == pytest.approx(1.0, abs=0.05)


@pytest.mark.slow
def test_a_problem_whose_torque_nothing_cuts_off_stays_as_it_is(
    arm: Robot, arm_log: Callable[..., Log], pose_arm: Callable[..., Problem]
) -> None:
    """Without flat tops the problem does not change."""
    problem = pose_arm(build_recording(arm, [arm_log(torque_noise=0.05)]))
    assert with_total_torque(problem, [], [CLIPPING, OTHER]) is problem


@pytest.mark.slow
def test_noise_that_is_cut_off_is_lost_on_average(hidden: tuple[Problem, np.ndarray, float]) -> None:
    """The column is the mean loss of noisy torques, to three standard errors, at every level."""
    problem, _, limit = hidden
    levels = limit * np.array([-1.2, -1.01, -0.98, 0.5, 0.97, 1.0, 1.02, 1.3])
    rows = np.repeat(levels, 400)
    state = problem.situation
    noise = 0.03 * limit * np.random.default_rng(2).normal(size=(5000, len(levels)))
    cut = np.clip(levels + noise, -limit, limit)
    size = len(state.t)
    whole, measured = np.zeros(state.q.shape), np.zeros(state.q.shape)
    whole[:, 0] = np.resize(rows, size)
    rng = np.random.default_rng(3)
    measured[:, 0] = np.clip(whole[:, 0] + 0.03 * limit * rng.normal(size=size), -limit, limit)
    seen = replace(state, measured=measured, beyond=whole - state.torque, _cache={})
    column = CurrentClipping().local(seen, 1, (limit,))[:, 0]
    lost = cut.mean(axis=0) - levels
    reported = np.array([column[np.argmin(np.abs(whole[:, 0] - level))] for level in levels])
    np.testing.assert_allclose(reported, lost, atol=3 * 0.03 * limit / np.sqrt(5000) + 0.002 * limit)


@pytest.mark.slow
def test_an_extended_model_cuts_off_all_of_its_torque(hidden: tuple[Problem, np.ndarray, float]) -> None:
    """A model clips the sum of base model and other effects, in any order of its extensions."""
    problem, _, limit = hidden
    state = replace(problem.situation, measured=None)
    other = Extension(effect=OTHER.name, joint=1, shape=(), coefficients=np.array([2.0, 1.0]), covariance=np.eye(2))
    clipping = Extension(effect=CLIPPING.name, joint=1, shape=(limit,), coefficients=np.ones(1), covariance=np.eye(2))
    whole = state.torque + other.torque(state)
    for extensions in ((other, clipping), (clipping, other)):
        torque = state.torque + extension_torque(extensions, state)
        np.testing.assert_allclose(torque[:, 0], np.clip(whole[:, 0], -limit, limit))
        np.testing.assert_allclose(torque[:, 1], whole[:, 1])


def test_flat_tops_stay_flat_where_a_log_is_thinned() -> None:
    """A low-pass that overshoots flat tops is limited to their level."""
    t = 0.004 * np.arange(2000)
    tau = np.column_stack([np.clip(np.sin(3 * t), -0.8, 0.8), np.sin(5 * t)])
    passed = tau + 0.01 * np.sin(200 * t)[:, None]
    kept = keep_clipped_level(tau, passed)
    top = np.abs(tau[:, 0]) == 0.8
    np.testing.assert_array_equal(kept[top, 0], tau[top, 0])
    assert np.abs(kept[:, 0]).max() == 0.8
    np.testing.assert_array_equal(kept[:, 1], passed[:, 1])

"""Tests of nonlinear torque readings, which bias a base model that is fitted to them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from estimation.diagnosis.hypothesis_tests.hypotheses import Hypothesis
from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.hypothesis_tests.refinement import refine
from estimation.diagnosis.hypothesis_tests.scoring import accept
from estimation.diagnosis.joint_fits.sensor_nonlinearity import fit_sensor_nonlinearity
from estimation.diagnosis.recordings.log_reading import build_recording
from estimation.diagnosis.searches.refit import refit
from robots.robot import Robot
from robots.signals import Log
from robots.terms.effect_bases.static import StaticJointEffect
from robots.terms.effects import EFFECTS

SATURATION, TILT = Hypothesis(EFFECTS["torque_constant_saturation"], 1), Hypothesis(EFFECTS["base_tilt"], None)


@pytest.mark.slow
@pytest.mark.parametrize("error", [0.85, 0.3, -0.25])
def test_base_model_and_a_false_reading_are_distinguished(
    arm: Robot, arm_log: Callable[..., Log], pose_arm: Callable[..., Problem], error: float
) -> None:
    """The joint fit reduces the base model's error to less than a sixth, and estimates the distortion to 10 %."""
    recording = build_recording(arm, [arm_log(torque_noise=0.05)])
    true = pose_arm(recording).situation.torque[:, 0]
    top = float(np.abs(true).max())
    tau = recording.tau.copy()
    tau[:, 0] += error * true * (np.abs(true) / top) ** 2
    problem = pose_arm(replace(recording, tau=tau))
    member = refine(problem, SATURATION, SATURATION.effect.grid(problem.situation, 1)[1], accept(problem, ()))
    there, (found,) = fit_sensor_nonlinearity(problem, [member])
    assert found.shape[0] == pytest.approx(2.0, abs=0.4)
    assert found.shape[1] == pytest.approx(top, rel=0.02)
    assert found.coefficients[0] == pytest.approx(error, rel=0.1)

    def off(torque: np.ndarray) -> float:
        return float(np.sqrt(np.mean((torque[:, 0] - true) ** 2)) / true.std())

    followed = off(problem.situation.torque)
    assert followed > 0.6 * abs(error)
    assert off(there.situation.torque) < 0.17 * followed
    assert off(problem.baseline.regressor @ refit(problem, [member]).values) < 0.17 * followed


def test_what_distorts_no_reading_is_left_as_it_is(
    arm: Robot, arm_log: Callable[..., Log], pose_arm: Callable[..., Problem]
) -> None:
    """Without a distorting effect, problem and effects do not change."""
    problem = pose_arm(build_recording(arm, [arm_log(torque_noise=0.05)]))
    member = refine(problem, TILT, (0.0,), accept(problem, ()))
    same, members = fit_sensor_nonlinearity(problem, [member])
    assert same is problem
    assert members == [member]


def test_slopes_of_a_reading_are_exact(
    arm: Robot, arm_log: Callable[..., Log], pose_arm: Callable[..., Problem]
) -> None:
    """Derivatives by the torque and by the exponent agree with finite differences."""
    situation = pose_arm(build_recording(arm, [arm_log()])).situation
    effect, c = SATURATION.effect, np.array([0.4])
    assert isinstance(effect, StaticJointEffect)
    shape, h = (1.7, 12.0), 1e-6

    def torque(more: float, exponent: float) -> np.ndarray:
        return effect.local(replace(situation, torque=situation.torque + more), 1, (shape[0] + exponent, shape[1])) @ c

    slopes = effect.slopes(situation, 1, c, shape)
    np.testing.assert_allclose(slopes[:, 0], (torque(h, 0) - torque(-h, 0)) / (2 * h), atol=1e-6)
    np.testing.assert_allclose(slopes[:, 1], (torque(0, h) - torque(0, -h)) / (2 * h), atol=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("error", [2.0, -0.2])
def test_a_reading_is_undone(
    arm: Robot, arm_log: Callable[..., Log], pose_arm: Callable[..., Problem], error: float
) -> None:
    """The inversion of a reading returns the true torque, also from another start."""
    situation = pose_arm(build_recording(arm, [arm_log()])).situation
    effect, c, shape = SATURATION.effect, np.array([error]), (2.0, float(np.abs(situation.torque[:, 0]).max()))
    assert isinstance(effect, StaticJointEffect)
    true = situation.torque[:, 0]
    reading = true + effect.local(situation, 1, shape) @ c
    near = replace(situation, torque=1.3 * situation.torque + 0.5, _cache={})
    np.testing.assert_allclose(effect.undone(near, 1, c, shape, reading), true, atol=1e-9)

"""Tests of the joint refit of base model and effects before the next search."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from estimation.diagnosis.hypothesis_tests.hypotheses import Hypothesis
from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.hypothesis_tests.refinement import refine
from estimation.diagnosis.hypothesis_tests.scoring import accept
from estimation.diagnosis.noise_models.whitening import Whitening
from estimation.diagnosis.recordings.log_reading import build_recording
from estimation.diagnosis.searches.refit import base_torque_changed, noise_decreased, refit
from robots.plants import simulate
from robots.robot import Robot
from robots.signals import Log, Motion
from robots.terms.effects import EFFECTS

LOST = 0.25
"""Of the shoulder's largest torque."""


@pytest.mark.slow
def test_torque_that_is_cut_off_does_not_draw_the_base_model(
    arm: Robot, arm_log: Callable[..., Log], pose_arm: Callable[..., Problem]
) -> None:
    """After the refit with a torque limit, the base model is accurate in clipped rows, where the first fit is too low.

    The log is clipped with its noise, so flat tops contain only negative noise.
    """
    recording = build_recording(arm, [arm_log(torque_noise=0.05)])
    true = recording.tau[:, 0]
    limit = (1 - LOST) * np.abs(true).max()
    tau = recording.tau.copy()
    tau[:, 0] = np.clip(true, -limit, limit)
    problem = pose_arm(replace(recording, tau=tau))
    fitted = problem.situation.torque[:, 0]
    hypothesis = Hypothesis(EFFECTS["current_clipping"], 1)
    member = refine(problem, hypothesis, (0.8 * float(np.abs(fitted).max()),), accept(problem, ()))
    settled = refit(problem, [member])
    cut = np.abs(true) > limit
    assert 0.03 < cut.mean() < 0.3
    whole = pose_arm(recording)

    def error(torque: np.ndarray) -> float:
        """Computes the RMS difference [N m] in clipped rows from the base model fitted to unclipped torque."""
        return float(np.sqrt(np.mean((torque - whole.situation.torque[:, 0])[cut] ** 2)))

    assert error(fitted) > 1.0
    assert error((problem.baseline.regressor @ settled.values)[:, 0]) < 0.05
    assert settled.extra is not None
    np.testing.assert_allclose(settled.extra[:, 1], 0.0)
    kept = ~recording.sign_unknown[:, 0]
    assert (
        settled.residual[kept, 0].std()
        < whole.base_residual[kept, 0].std()
        < problem.base_residual[kept, 0].std() / 1.5
    )


@pytest.mark.slow
def test_little_is_searched_anew_where_it_changes_what_was_found(
    arm: Robot, arm_log: Callable[..., Log], pose_arm: Callable[..., Problem]
) -> None:
    """A small clipping changes the base torque by less than counts, but the clipped part by more."""
    recording = build_recording(arm, [arm_log(torque_noise=0.05)])
    limit = 0.85 * np.abs(recording.tau[:, 0]).max()
    tau = recording.tau.copy()
    tau[:, 0] = np.clip(tau[:, 0], -limit, limit)
    problem = pose_arm(replace(recording, tau=tau))
    level = 0.85 * 1.06 * float(np.abs(problem.situation.torque[:, 0]).max())
    member = refine(problem, Hypothesis(EFFECTS["current_clipping"], 1), (level,), accept(problem, ()))
    values = refit(problem, [member]).values
    assert not base_torque_changed(problem, values, [])
    assert base_torque_changed(problem, values, [member])
    assert not base_torque_changed(
        problem, problem.parameters_without_payload[list(problem.baseline.base.independent)], [member]
    )


@pytest.mark.slow
def test_a_search_is_done_again_where_the_slow_part_of_the_noise_is_smaller(
    arm: Robot, arm_plant: Callable, fourier_motion: Callable[..., Motion], pose_arm: Callable[..., Problem]
) -> None:
    """Noise with a quarter less power at zero frequency has decreased; with a tenth less it has not."""
    problem = pose_arm(
        build_recording(arm, [simulate(arm_plant(torque_noise=0.05), fourier_motion(arm, duration=30.0))])
    )
    known = problem.whitening

    def less(power: float) -> Whitening:
        """Returns the noise model with a given power of the first joint at zero frequency, over the known power."""
        first = known.coefficients[0]
        gain = (1.0 - first.sum()) / np.sqrt(power)
        return replace(known, coefficients=(first + (1.0 - first.sum() - gain) / len(first), *known.coefficients[1:]))

    assert noise_decreased(problem, less(0.75))
    assert not noise_decreased(problem, less(0.9))
    assert not noise_decreased(problem, less(1.3))
    assert noise_decreased(problem, replace(known, scale=0.9 * known.scale))

"""Tests of the fits in turn of a base model and of effects that depend on its load and inertia."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from estimation.diagnosis.hypothesis_tests.hypotheses import Hypothesis
from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.hypothesis_tests.refinement import refine
from estimation.diagnosis.hypothesis_tests.scoring import accept
from estimation.diagnosis.recordings.log_reading import build_recording
from estimation.diagnosis.searches.joint_refinement import relinearise
from robots.robot import Robot
from robots.signals import Log
from robots.terms.effects import EFFECTS


@pytest.mark.slow
def test_compliance_is_that_of_the_robot_without_the_effect(
    arm: Robot, arm_log: Callable[..., Log], pose_arm: Callable[..., Problem]
) -> None:
    """A base model that absorbed part of a soft gear biases its compliance; fits in turn remove most of that."""
    recording = build_recording(arm, [arm_log(torque_noise=0.005)])
    hypothesis = Hypothesis(EFFECTS["joint_elasticity"], 1)
    plain = pose_arm(recording)
    shape = hypothesis.effect.grid(plain.situation, 1)[5]
    columns = plain.dense(hypothesis, shape)[:, :, 0]
    compliance = 0.5 * recording.tau[:, 0].std() / columns[:, 0].std()
    posed = pose_arm(replace(recording, tau=recording.tau + compliance * columns))
    first = refine(posed, hypothesis, shape, accept(posed, ()), effort=10)
    again, (second,) = relinearise(posed, [first])
    errors = [abs(member.coefficients[0] / compliance - 1.0) for member in (first, second)]
    assert errors[1] < 0.5 * errors[0]
    assert second.gain > first.gain
    assert again.whitening is posed.whitening


@pytest.mark.slow
def test_effects_of_position_need_no_repetition(
    arm: Robot, arm_log: Callable[..., Log], pose_arm: Callable[..., Problem]
) -> None:
    """A spring does not depend on the base model, so nothing is fitted again."""
    posed = pose_arm(build_recording(arm, [arm_log(torque_noise=0.02)]))
    hypothesis = Hypothesis(EFFECTS["spring"], 1)
    member = refine(posed, hypothesis, (0.0, 0.0, 1.0), accept(posed, ()), effort=0)
    again, members = relinearise(posed, [member])
    assert again is posed
    assert members == [member]
    assert np.isfinite(member.coefficients).all()

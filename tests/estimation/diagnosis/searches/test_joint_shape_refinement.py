"""Tests of the joint refinement of several effects on one joint."""

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
from estimation.diagnosis.searches.joint_refinement import refine_shapes_jointly
from estimation.diagnosis.searches.selection import FAR_MORE, _refit_with_candidate
from robots.robot import Robot
from robots.signals import Log
from robots.terms.effects import EFFECTS

LOAD, IRON = (Hypothesis(EFFECTS[name], 2) for name in ("load_dependent_friction", "torque_constant_saturation"))
SHARE = 0.12


@pytest.fixture(scope="module")
def problem(arm: Robot, arm_log: Callable[..., Log], pose_arm: Callable[..., Problem]) -> Problem:
    """Returns a log of joint 2 with load-dependent friction and quadratic saturation of the torque constant."""
    recording = build_recording(arm, [arm_log(torque_noise=0.01)])
    situation = pose_arm(recording).situation
    top = float(np.abs(situation.torque[:, 1]).max())
    gear = LOAD.effect.columns(situation, 2, (1.0, 0.0))[:, :, 0] * SHARE
    iron = IRON.effect.columns(situation, 2, (2.0, top))[:, :, 0] * SHARE
    return pose_arm(replace(recording, tau=recording.tau + gear + iron))


@pytest.mark.slow
def test_together_they_leave_the_valley_in_which_one_does_what_the_other_should(problem: Problem) -> None:
    """Joint refinement finds both true shapes, where refining one effect after the other does not."""
    alone = refine(problem, LOAD, (1.0, 0.0), accept(problem, ()))
    assert alone.shape[0] < 0.8
    second = refine(problem, IRON, IRON.effect.grid(problem.situation, 2)[0], accept(problem, (alone.group,)))
    load, iron = refine_shapes_jointly(problem, [alone, second])
    assert load.shape[0] == pytest.approx(1.0, abs=0.1)
    assert iron.shape[0] == pytest.approx(2.0, abs=0.2)
    both = accept(problem, (load.group, iron.group)).gain
    assert both > accept(problem, (alone.group, second.group)).gain
    # An effect that is alone on its joint does not change.
    assert refine_shapes_jointly(problem, [alone]) == [alone]


@pytest.mark.slow
def test_what_explains_far_more_beside_another_form_is_taken_with_it(problem: Problem) -> None:
    """A candidate is added with a refit of the first effect if that increases its gain much; otherwise it is not."""
    alone = refine(problem, LOAD, (1.0, 0.0), accept(problem, ()))
    second = refine(problem, IRON, IRON.effect.grid(problem.situation, 2)[0], accept(problem, (alone.group,)))
    formed = _refit_with_candidate(problem, second, [alone])
    assert formed is not None
    assert [member.hypothesis for member in formed] == [LOAD, IRON]
    assert formed[1].gain > FAR_MORE * second.gain
    assert formed[1].coefficients[0] == pytest.approx(SHARE, rel=0.15)
    other = refine(problem, Hypothesis(EFFECTS["stribeck"], 2), (0.1, 1.0), accept(problem, (alone.group,)))
    assert _refit_with_candidate(problem, other, [alone]) is None

"""Specification of how well shapes are known: a velocity whose exponent is open too."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from estimation.diagnosis.hypotheses import Hypothesis
from estimation.diagnosis.problem import Problem
from estimation.diagnosis.refinement import refine
from estimation.diagnosis.scoring import accept, score
from estimation.diagnosis.shape_errors import shape_errors
from estimation.diagnosis.states import record
from robots.robot import Robot
from robots.signals import Log
from robots.terms.effects import EFFECTS

STRIBECK = Hypothesis(EFFECTS["stribeck"], 1)
SPEED, EXPONENT = 0.25, 1.5
BOUND = 3.84  # of twice the logarithm of the likelihood ratio: 95 %


@pytest.mark.parametrize("size", [1.6, 2.5])
def test_a_velocity_is_as_uncertain_as_its_exponent_lets_it_be(
    arm: Robot, arm_log: Callable[..., Log], pose_arm: Callable[..., Problem], size: float
) -> None:
    """Its interval is that of the likelihood on a grid of both, and wider than with the exponent held."""
    recording = record(arm, [arm_log(torque_noise=0.02)])
    extra = np.zeros_like(recording.tau)
    speed = np.abs(recording.dq[:, 0])
    extra[:, 0] = size * np.exp(-((speed / SPEED) ** EXPONENT)) * np.sign(recording.dq[:, 0])
    problem = pose_arm(replace(recording, tau=recording.tau + extra))
    nothing = accept(problem, ())
    member = refine(problem, STRIBECK, (0.2, 1.0), nothing)
    velocity = member.shape[0]
    velocities = velocity * np.exp(np.linspace(-1.0, 1.0, 81))
    exponents = np.linspace(0.5, 2.5, 41)
    gains = np.array(
        [[score(problem, problem.measured(STRIBECK, (v, d)), nothing).gain for d in exponents] for v in velocities]
    )
    profile, held = gains.max(axis=1), gains[:, np.argmin(np.abs(exponents - member.shape[1]))]
    wanted, narrow = (
        np.abs(np.log(velocities[curve.max() - curve < BOUND] / velocity)).max() for curve in (profile, held)
    )
    told = 1.96 * shape_errors(problem, member, nothing)[0] / velocity
    assert told == pytest.approx(wanted, abs=0.03)
    assert told > 1.2 * narrow
    assert abs(np.log(velocity / SPEED)) < told


@pytest.mark.parametrize(("share", "told"), [(0.0, True), (1.0, True), (0.0, False)])
def test_a_choice_is_told_where_the_other_explains_less(
    arm: Robot, arm_log: Callable[..., Log], pose_arm: Callable[..., Problem], share: float, told: bool
) -> None:
    """A ripple by the load is told from one by the motor's torque; one that does not grow with either is not."""
    recording = record(arm, [arm_log(torque_noise=0.02)])
    ripple = Hypothesis(EFFECTS["torque_ripple"], 1)
    now = pose_arm(recording).situation
    X = ripple.effect.columns(now, 1, (40.0, 0.0, share))
    coefficients = np.array([0.02, 0.0, 0.2, 0.1]) if told else np.array([0.5, 0.3, 0.0, 0.0])
    problem = pose_arm(replace(recording, tau=recording.tau + X @ coefficients))
    member = refine(problem, ripple, (40.0, 0.0, 0.0), accept(problem, ()))
    error = shape_errors(problem, member, accept(problem, ()))[2]
    assert error == (0.0 if told else np.inf)
    if told:
        assert member.shape[2] == share

"""Tests of rival shapes: the chance of an experiment counts with the shape in which a rival fits best."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from estimation.diagnosis.experiment_plans.experiment_grams import Grams
from estimation.diagnosis.experiment_plans.experiment_motions import MAKERS, motion_range
from estimation.diagnosis.experiment_plans.next_experiment import RivalShape, find_rival_shapes, plan_next
from estimation.diagnosis.experiment_plans.planned_limits import planned_problem
from estimation.diagnosis.hypothesis_tests.hypotheses import Hypothesis
from estimation.diagnosis.hypothesis_tests.problem import Problem
from robots.loading import load_robot
from robots.plants import Sensors
from robots.regressor import default_model
from robots.signals import Motion
from robots.terms.effects import EFFECTS

JOINT = 2


@pytest.fixture(scope="module")
def problem() -> Problem:
    """Returns the planned problem of a UR10 that follows slow sines."""
    robot = replace(load_robot("ur10"), friction=np.tile([10.0, 15.0, 0.0, 0.0], (6, 1)))
    t = 0.008 * np.arange(3000)
    rates = np.array([0.7, 1.1, 1.3, 1.7, 2.1, 2.6])
    q, dq, ddq = (0.5 * rates**k * f(np.outer(t, rates)) for k, f in enumerate((np.sin, np.cos, lambda x: -np.sin(x))))
    model = default_model(robot, velocity_scale=2e-3)
    return planned_problem(model, model.nominal, [Motion(t, q, dq, ddq)], noise=Sensors(torque_noise=0.025))


def _cause(problem: Problem, name: str, shape: tuple[float, ...], size: float) -> RivalShape:
    """Builds an effect with one column and a given torque RMS [N m]."""
    X = EFFECTS[name].columns(problem.situation, JOINT, shape)
    return RivalShape(
        Hypothesis(EFFECTS[name], JOINT), shape, np.array([size / np.sqrt(np.mean(X[:, JOINT - 1] ** 2))])
    )


@pytest.mark.slow
def test_the_chance_is_that_of_the_form_that_imitates_best(problem: Problem) -> None:
    """With the found rival shapes the chance is clearly lower, and close to the lowest over a dense grid of shapes."""
    thinning = _cause(problem, "shear_thinning", (0.3,), 8.0)
    stribeck = _cause(problem, "stribeck", (0.2, 2.0), 8.0)
    causes = [thinning, stribeck]
    forms = find_rival_shapes(problem, causes)
    assert all(form.hypothesis.effect.name == ("shear_thinning", "stribeck")[k] for k, form in forms)
    trials = [
        (1, replace(stribeck, shape=(float(v), float(exponent))))
        for v in np.geomspace(0.02, 1.0, 12)
        for exponent in (0.5, 0.7, 1.0, 1.5, 2.0)
    ]
    stages = MAKERS["micro_reversals"](motion_range(problem.situation.robot, problem.recording), JOINT - 1, 0)
    plain, reported, least = (
        grams.chances_of([grams.of(stages)])[0, 1]
        for grams in (Grams(problem, causes, some) for some in ((), forms, trials))
    )
    assert plain > 0.9
    assert reported < 0.7 * plain
    assert reported < least + 0.2


@pytest.mark.slow
@pytest.mark.longer
def test_a_plan_counts_with_such_forms(problem: Problem) -> None:
    """The planned chance is below that of causes with fixed shapes."""
    causes = [_cause(problem, "shear_thinning", (0.3,), 8.0), _cause(problem, "stribeck", (0.2, 2.0), 8.0)]
    plan = plan_next(problem, causes)
    assert plan is not None
    assert plan.resolves < Grams(problem, causes).chance(plan.stages)


def test_what_has_no_other_form_is_taken_as_it_was_fitted(problem: Problem) -> None:
    """Effects without shape parameters, and those with times in the logs, have no rival shapes."""
    end = float(problem.recording.t[-1])
    step = RivalShape(Hypothesis(EFFECTS["friction_step"], JOINT), (0.5 * end,), np.array([2.0, 1.0]))
    offset = RivalShape(Hypothesis(EFFECTS["encoder_offset"], JOINT), (), np.array([0.01]))
    assert find_rival_shapes(problem, [step, offset]) == []

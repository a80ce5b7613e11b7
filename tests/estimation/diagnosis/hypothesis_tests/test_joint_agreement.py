"""Tests of a coefficient that all joints share: the agreement of the joints, and the gain that counts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from estimation.diagnosis.experiment_plans.planned_limits import planned_problem
from estimation.diagnosis.hypothesis_tests.hypotheses import Hypothesis
from estimation.diagnosis.hypothesis_tests.joint_agreement import per_joint_evidence, shared_coefficient_gain
from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.hypothesis_tests.scoring import Accepted, accept
from robots.loading import load_robot
from robots.plants import Sensors
from robots.regressor import default_model
from robots.signals import Motion
from robots.terms.effects import EFFECTS

# Positions, velocities and accelerations of a wave, per unit of its rate.
_WAVES = ((0, np.sin), (1, np.cos), (2, lambda phase: -np.sin(phase)))


def _shared(*coefficients: float, error: float = 0.01) -> tuple[float, float]:
    """Returns the gain of a shared coefficient, and the part that counts, for given estimates of the joints."""
    gram = np.full(len(coefficients), error**-2)
    cross = gram * coefficients
    return float(cross.sum() ** 2 / gram.sum()), shared_coefficient_gain(gram, cross)


def test_joints_that_agree_within_the_formula_count_in_full() -> None:
    """Estimates that differ by a fifth count in full, because the formula is not more accurate."""
    gain, agreed = _shared(0.9, 1.0, 1.1, 1.05)
    assert agreed == pytest.approx(gain)
    few, count = _shared(0.9, 1.1)
    assert count == pytest.approx(few)


def test_one_joint_at_odds_counts_for_nothing_and_the_rest_in_full() -> None:
    """If one of four joints contradicts, the gain of the other three counts."""
    _, agreed = _shared(1.0, 1.0, 1.0, -4.0)
    rest, _ = _shared(1.0, 1.0, 1.0)
    assert agreed == pytest.approx(rest)


def test_what_one_joint_alone_tells_is_no_common_coefficient() -> None:
    """An estimate on one joint, with none on the others, hardly counts."""
    gain, agreed = _shared(1.0, 0.0, 0.0, 0.0)
    assert agreed < 0.1 * gain
    _, agreed = _shared(1.0, -1.0, 1.0, -1.0)
    assert agreed < 0.01 * _shared(1.0, 1.0, 1.0, 1.0)[0]


@pytest.mark.slow
def test_reversals_tell_a_delay_no_better_than_their_moments_are_known() -> None:
    """Information g from reversals with time error m is reduced to 1 / (1 / g + m^2); other rows count in full."""
    robot = load_robot("ur10")
    t = 0.004 * np.arange(3000)
    phase = 2 * np.pi * 0.3 * t[:, None] * (1 + 0.1 * np.arange(6))
    rate = phase[-1] / t[-1]
    motion = Motion(t, np.sin(phase), rate * np.cos(phase), -(rate**2) * np.sin(phase))
    model = default_model(replace(robot, friction=np.full((6, 4), 3.0)), velocity_scale=2e-3)
    problem = planned_problem(model, model.nominal, [motion], noise=Sensors(torque_noise=0.025))

    def measured(clear: np.ndarray, moment: float) -> tuple[np.ndarray, np.ndarray]:
        trusted = np.arange(6) < 4
        known = replace(
            problem.recording,
            sign_known_from_velocity=clear,
            trusted=trusted,
            reversal_time_error=np.full(motion.q.shape, moment),
        )
        seen: Problem = replace(problem, recording=known)
        evidence = per_joint_evidence(seen, Hypothesis(EFFECTS["time_delay"], None), (2e-4,), accept(seen, ()))
        return evidence.gram, evidence.certain_share

    everywhere, nowhere = np.ones(motion.q.shape, dtype=bool), np.zeros(motion.q.shape, dtype=bool)
    gram, sure = measured(everywhere, 1e-4)
    assert (gram[:4] > 0).all()
    np.testing.assert_allclose(sure[:4], 1.0 / (1.0 + 1e-8 * gram[:4]), rtol=1e-4)
    assert (sure[:4] < 1.0).all()
    np.testing.assert_array_equal(sure[4:], 1.0)
    np.testing.assert_allclose(measured(nowhere, 1e-4)[1], 1.0)
    np.testing.assert_array_equal(measured(everywhere, 0.0)[1], 1.0)


def test_a_joint_whose_other_effects_formula_may_hide_it_need_not_agree() -> None:
    """A joint where another effect's formula error is larger than the coefficient need not agree."""
    gram, own = np.array([1e4, 1e4, 2e3, 1e3]), np.array([2.0, 2.0, 0.1, -0.6])
    cross, apart = gram * own, np.array([0.0, 0.0, 2.0, 2.0]) ** 2
    whole = float(cross.sum() ** 2 / gram.sum())
    assert shared_coefficient_gain(gram, cross, apart) > 0.9 * whole
    assert shared_coefficient_gain(gram, cross) < 0.3 * whole
    # An estimate on these joints only is no delay either.
    alone = gram * np.array([0.0, 0.0, 1.0, 1.0])
    assert shared_coefficient_gain(gram, alone, apart) < 0.02 * float(alone.sum() ** 2 / gram.sum())


@pytest.mark.slow
def test_what_other_effects_explain_on_a_joint_makes_its_own_coefficient_doubtful() -> None:
    """The formula variance of a joint's coefficient is from 5 % of the torque of accepted effects there."""
    robot = load_robot("ur10")
    t = 0.004 * np.arange(3000)
    motion = Motion(t, *(np.outer(f(2.0 * t), 2.0**k * np.linspace(0.4, 1.0, 6)) for k, f in _WAVES))
    model = default_model(replace(robot, friction=np.full((6, 4), 3.0)), velocity_scale=2e-3)
    problem = planned_problem(model, model.nominal, [motion], noise=Sensors(torque_noise=0.025))
    friction = problem.measured(Hypothesis(EFFECTS["stribeck"], 2), (0.3, 1.0))
    root = 1.0 / np.sqrt(friction.gram)
    accepted = Accepted((friction,), root, np.array([100.0]))
    evidence = per_joint_evidence(problem, Hypothesis(EFFECTS["time_delay"], None), (2e-4,), accepted)
    np.testing.assert_array_equal(evidence.formula_variance[[0, 2, 3, 4, 5]], 0.0)
    coefficients = root.T @ accepted.cross
    torque = friction.columns[0].astype(float) @ coefficients
    assert evidence.formula_variance[1] == pytest.approx(
        (0.05**2) * float(torque @ torque) / evidence.gram[1], rel=1e-4
    )

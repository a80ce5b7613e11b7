"""Drive gains from a payload that is known."""

import numpy as np
import pytest

from estimation.estimators.drive_gains import CurrentRun, fit_drive_gains
from robots.common.errors import InputError, NotIdentifiableError
from robots.geometry.inertia import inertial_parameters

LOAD = inertial_parameters(1.5, [0.05, 0.02, 0.1], np.diag([0.004, 0.005, 0.003]), np.eye(4))


def gains_of(problem):
    n = problem.base.model.robot.n
    return np.random.default_rng(4).uniform(5, 15, n) * np.where(np.arange(n) % 2, -1, 1)


def runs(problem, noise=0.0, seed=0, loads=(None, LOAD), rows=1500):
    """Currents of the same arm with and without the payload."""
    model = problem.base.model
    last = [k for k, column in enumerate(model.columns) if column.term == "rigid_body"][-10:]
    rng = np.random.default_rng(seed)
    found = []
    for index, load in enumerate(loads):
        motion = problem.motion(index, rows=rows, period=0.008)
        state = motion.q, motion.dq, motion.ddq
        tau = problem.base.torque(*state, problem.truth)
        if load is not None:
            tau = tau + model.torque(*state, load, columns=last)
        current = tau / gains_of(problem)
        current = current + noise * current.std(axis=0) * rng.standard_normal(current.shape)
        found.append(CurrentRun(motion=motion, current=current, mask=np.ones_like(current), payload=load))
    return found


def test_exact_currents_give_the_gains(problem):
    """Without noise, every joint's gain comes back, with its sign, and the robot's parameters with it."""
    found = fit_drive_gains(problem.base, runs(problem))
    np.testing.assert_allclose(found.gains, gains_of(problem), rtol=1e-4)
    motion = problem.motion(5)
    error = problem.base.torque(motion.q, motion.dq, motion.ddq, found.values - problem.truth)
    torque = problem.base.torque(motion.q, motion.dq, motion.ddq, problem.truth)
    assert (error.std(axis=0) < 1e-3 * torque.std(axis=0)).all()


def test_noise_does_not_shrink_them(problem_named):
    """With 10 % noise in the currents the mean gain of 20 runs is right; least squares would be a per cent low."""
    problem = problem_named("with a prismatic joint")
    found = np.array([fit_drive_gains(problem.base, runs(problem, 0.1, seed)).gains for seed in range(20)])
    share = found / gains_of(problem) - 1
    # Three joints, t of 19 degrees of freedom: a wrong alarm in 1 of 500 draws, and the draws are fixed.
    assert np.abs(share.mean(axis=0) / (share.std(axis=0, ddof=1) / np.sqrt(20))).max() < 4


def test_their_standard_errors_are_honest(problem_named):
    """White noise of 2 % scatters the gains as the stated standard errors say, within 40 %."""
    problem = problem_named("two joints")
    found = [fit_drive_gains(problem.base, runs(problem, 0.02, seed)) for seed in range(30)]
    scatter = np.std([f.gains for f in found], axis=0)
    # A standard deviation from 30 runs is known to 13 %.
    np.testing.assert_allclose(scatter, np.mean([f.standard_errors for f in found], axis=0), rtol=0.4)


def test_gains_need_a_payload(problem_named):
    """Without a known payload the scale is open, and a joint that feels nothing of it stays open too."""
    problem = problem_named("two joints")
    with pytest.raises(InputError, match="known payload"):
        fit_drive_gains(problem.base, runs(problem, loads=(None, None)))
    with pytest.raises(NotIdentifiableError, match="do not determine all drive gains"):
        fit_drive_gains(problem.base, runs(problem, loads=(None, np.zeros(10))))
    with pytest.raises(InputError, match="allowed: "):
        fit_drive_gains(problem.base, runs(problem, loads=(np.zeros(3),)))

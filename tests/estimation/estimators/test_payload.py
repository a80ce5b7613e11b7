"""A payload from a run with it."""

import numpy as np
import pytest

from estimation.estimators.payload import fit_payload
from estimation.regressions.preparation import Rows
from robots.common.errors import InputError
from robots.geometry.inertia import inertial_parameters
from robots.regressor import TorqueModel
from robots.terms import RotorInertia

LOAD = inertial_parameters(1.5, [0.05, 0.02, 0.1], np.diag([0.004, 0.005, 0.003]), np.eye(4))


def run_with(problem, noise=0.0, seed=0, rows=1500):
    model = problem.base.model
    last = [k for k, column in enumerate(model.columns) if column.term == "rigid_body"][-10:]
    motion = problem.motion(seed, rows=rows, period=0.008)
    state = motion.q, motion.dq, motion.ddq
    tau = problem.base.torque(*state, problem.truth) + model.torque(*state, LOAD, columns=last)
    tau = tau + noise * tau.std(axis=0) * np.random.default_rng(seed).standard_normal(tau.shape)
    return Rows(motion, tau, np.ones_like(tau))


@pytest.mark.parametrize("name", ["with a prismatic joint", "seven joints"])
def test_an_exact_run_gives_the_payload(problem_named, name):
    """Without noise, all ten parameters of the payload come back."""
    problem = problem_named(name)
    payload = fit_payload(problem.base.model, problem.standard, [run_with(problem)])
    assert payload.determined.all()
    np.testing.assert_allclose(payload.parameters, LOAD, atol=1e-9)
    assert (payload.eigenvalues > 0).all()
    assert payload.mass == pytest.approx(1.5)
    np.testing.assert_allclose(payload.centre, [0.05, 0.02, 0.1], atol=1e-8)
    assert (payload.residual_rms < 0.01 * payload.unloaded_rms.max()).all()


def test_a_noisy_run_gives_it_within_its_errors(problem_named):
    """With 5 % noise, the errors of the parameters are those stated: 30 runs, chi-square within its 99.9 % bounds."""
    problem = problem_named("seven joints")
    z = []
    for seed in range(30):
        payload = fit_payload(
            problem.base.model, problem.standard, [run_with(problem, 0.05, seed, rows=400)], consistent=False
        )
        z.append((payload.parameters - LOAD) / payload.standard_errors)
    # 300 squares, those of a run correlated: mean 1, standard deviation below .2.
    assert 0.5 < np.mean(np.square(z)) < 1.7


def test_it_is_a_body_even_if_noise_says_otherwise(problem_named):
    """With 30 % noise, the plain fit is no body in some run; the consistent one always is, and says the mass."""
    problem = problem_named("seven joints")
    plain, consistent = (
        [
            fit_payload(problem.base.model, problem.standard, [run_with(problem, 0.3, seed, rows=300)], consistent=kept)
            for seed in range(6)
        ]
        for kept in (False, True)
    )
    assert min(payload.eigenvalues.min() for payload in plain) < 0
    assert all((payload.eigenvalues > 0).all() for payload in consistent)
    assert all(abs(payload.mass - 1.5) < 4 * payload.standard_errors[0] for payload in consistent)


def test_the_models_own_errors_count(problem_named):
    """A model that is not sure of itself makes the payload less sure."""
    problem = problem_named("with a prismatic joint")
    base = problem.base
    run = [run_with(problem, 0.02)]
    sure = fit_payload(base.model, problem.truth, run, columns=base.independent)
    covariance = np.diag((0.01 * np.abs(problem.truth) + 1e-3) ** 2)
    unsure = fit_payload(base.model, problem.truth, run, columns=base.independent, covariance=covariance)
    assert (unsure.standard_errors > sure.standard_errors).all()
    np.testing.assert_allclose(unsure.parameters, sure.parameters)


def test_what_one_joint_cannot_tell_is_marked(problem_named):
    """A pendulum tells three of the ten parameters by themselves; the others have no standard error to trust."""
    problem = problem_named("one joint")
    payload = fit_payload(problem.base.model, problem.standard, [run_with(problem)])
    assert payload.determined.sum() == 3
    assert np.isinf(payload.standard_errors[~payload.determined]).all()
    np.testing.assert_allclose(payload.parameters[payload.determined], LOAD[payload.determined], atol=1e-4)


def test_a_model_without_links_is_refused(problem_named):
    """No links, no payload; and no runs, no fit."""
    problem = problem_named("one joint")
    bare = TorqueModel(problem.base.model.robot, (RotorInertia(),))
    with pytest.raises(InputError, match="has no links"):
        fit_payload(bare, np.ones(1), [run_with(problem)])
    with pytest.raises(InputError, match="allowed: one or more"):
        fit_payload(problem.base.model, problem.standard, [])

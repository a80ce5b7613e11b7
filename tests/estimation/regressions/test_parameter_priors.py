from dataclasses import replace

import numpy as np
import pytest

from estimation.regressions.moments import Moments
from estimation.regressions.parameter_priors import GaussianPrior, friction_levels, link_spreads, prior_from_description
from robots.base_parameters import find_base_parameters
from robots.regressor import default_model


@pytest.fixture(scope="module")
def base(arm):
    return find_base_parameters(default_model(arm, velocity_scale=0.01))


def test_the_pull_is_to_the_description(base, arm):
    """Its target is what the robot's description says, and what the description calls large may be off by more."""
    ones = np.ones(base.size)
    pull = prior_from_description(base, np.asarray(arm.inertia), np.ones(2), ones)
    np.testing.assert_allclose(pull.target, base.from_standard(base.model.nominal))
    assert (np.linalg.eigvalsh(pull.precision) > 0).all()
    spreads = link_spreads(np.asarray(arm.inertia))
    assert spreads.shape == (2, 10)
    np.testing.assert_allclose(spreads[:, 0], [4.0, 2.0])
    np.testing.assert_allclose(spreads[0, 9], 4.0 * (0.31 / 4.0))  # m l^2, l^2 = (Ixx + Iyy + Izz) / 2 / m


def test_without_description_there_is_no_pull(arm):
    """A robot whose inertial parameters nobody states is not pulled to zero masses."""
    bare = replace(arm, inertia=None)
    assert (
        prior_from_description(find_base_parameters(default_model(bare)), np.ones((2, 10)), np.ones(2), np.ones(100))
        is None
    )


def test_friction_counts_at_the_limit_velocity(base, arm):
    """The level of a cubic friction column is that of the joint's highest speed, not of a slow log."""
    levels = friction_levels(base, np.full(base.size, 0.1), np.array([0.5, 6.0]))
    of = dict(zip(base.names, levels, strict=True))
    assert of["f4_1"] == pytest.approx(4.0**3)  # the limit
    assert of["f4_2"] == pytest.approx(6.0**3)  # seen above the limit
    assert of["f2_1"] == pytest.approx(4.0)
    assert of["mPx_2"] == pytest.approx(0.1)


def test_a_ridge_with_a_pull_is_a_quadratic_penalty():
    """The solution minimises the weighted squares plus ridge times all torque times (pi - target)' P (pi - target)."""
    rng = np.random.default_rng(0)
    Y, tau = rng.normal(size=(50, 2, 4)), rng.normal(size=(50, 2))
    root = rng.normal(size=(4, 4))
    pull = GaussianPrior(root @ root.T + np.eye(4), rng.normal(size=4))
    weights, ridge = np.array([1.0, 0.3]), 0.05
    moments = Moments.of(Y, tau, np.ones((50, 2))).pulled(pull)
    strength = ridge * float(weights @ moments.square)
    rows = (Y * np.sqrt(weights)[:, None]).reshape(-1, 4)
    factor = np.linalg.cholesky(pull.precision).T * np.sqrt(strength)
    stacked = np.vstack([rows, factor])
    right = np.concatenate([(tau * np.sqrt(weights)).reshape(-1), factor @ pull.target])
    expected = np.linalg.lstsq(stacked, right, rcond=None)[0]
    np.testing.assert_allclose(moments.solve(weights, ridge), expected, rtol=1e-8)

from dataclasses import replace

import numpy as np
import pytest

from estimation.estimators import WeightedLeastSquares
from estimation.regressions.default_prior import default_prior, weighed_prior
from estimation.regressions.moments import Moments
from estimation.regressions.parameter_priors import GaussianPrior
from robots.base_parameters import find_base_parameters
from robots.regressor import default_model


@pytest.fixture(scope="module")
def base(arm):
    return find_base_parameters(default_model(arm, velocity_scale=0.01))


def test_the_target_is_the_description(base, arm):
    """The prior's mean is the described arm; without a description it is an arm without torque, not without spread."""
    prior = default_prior(base, np.ones(2), np.ones(base.model.size))
    np.testing.assert_allclose(prior.target, base.from_standard(base.model.nominal))
    bare = find_base_parameters(default_model(replace(arm, inertia=None), velocity_scale=0.01, rotor=False))
    prior = default_prior(bare, np.array([20.0, 5.0]), np.ones(bare.model.size))
    inertial = [k for k, column in enumerate(bare.columns) if column.term == "rigid_body"]
    assert not prior.target[inertial].any()
    assert (np.linalg.eigvalsh(prior.precision) > 0).all()


@pytest.mark.parametrize("links", [slice(None), slice(1, None)])
def test_a_placeholder_is_no_description(arm, links):
    """Links of a gram, as exporters write them for links without material, scatter as links without description do.

    Else the fit would hold them at a gram: 26 % of a joint's torque remained with such a description.
    """
    spreads = []
    for mass in (1e-3, np.nan):
        inertia = np.array(arm.inertia)
        inertia[links] = mass * np.array([1.0, 0, 0, 0, 1e-3, 0, 0, 1e-3, 0, 1e-3])
        base = find_base_parameters(default_model(replace(arm, inertia=inertia), velocity_scale=0.01))
        prior = default_prior(base, np.array([20.0, 5.0]), np.ones(base.model.size))
        spreads.append(np.sqrt(np.diag(np.linalg.inv(prior.precision))))
    np.testing.assert_allclose(spreads[0], spreads[1], rtol=1e-6)


def test_units_of_mass_do_not_matter(arm):
    """An arm a thousand times lighter, with torques a thousand times smaller, has a prior a thousand times narrower."""
    for inertia in (np.asarray(arm.inertia), None):
        heavy = find_base_parameters(default_model(replace(arm, inertia=inertia), velocity_scale=0.01))
        light = find_base_parameters(
            default_model(replace(arm, inertia=None if inertia is None else 1e-3 * inertia), velocity_scale=0.01)
        )
        level, spread = np.ones(heavy.model.size), np.array([20.0, 5.0])
        first, second = default_prior(heavy, spread, level), default_prior(light, 1e-3 * spread, level)
        np.testing.assert_allclose(second.precision, 1e6 * first.precision, rtol=1e-6, atol=1e-9)


def test_a_prior_counts_as_it_says():
    """The weighed prior gives the mean of the posterior density, computed row by row."""
    rng = np.random.default_rng(0)
    Y, truth = rng.normal(size=(400, 2, 4)), np.array([1.0, -0.5, 2.0, 0.3])
    Y[:, :, 3] *= 0.01
    tau = Y @ truth + rng.normal(size=(400, 2)) * [0.5, 2.0]
    moments = Moments.of(Y, tau, np.ones((400, 2)))
    prior = GaussianPrior(np.diag([1.0, 1.0, 1.0, 4.0]), np.zeros(4))
    rows = 5.0
    wls = WeightedLeastSquares()
    ridge, weighed = weighed_prior(wls.solve, moments, prior, rows)
    values, weights = wls.solve(moments.pulled(weighed), ridge)
    stacked = np.vstack([(Y * np.sqrt(weights / rows)[:, None]).reshape(-1, 4), np.diag([1.0, 1.0, 1.0, 2.0])])
    right = np.concatenate([(tau * np.sqrt(weights / rows)).ravel(), np.zeros(4)])
    np.testing.assert_allclose(values, np.linalg.lstsq(stacked, right, rcond=None)[0], rtol=1e-3)


def test_data_that_contradict_the_prior_win():
    """Where rows say clearly that a value is many standard deviations away, the prior there lets go."""
    rng = np.random.default_rng(1)
    Y = rng.normal(size=(60, 1, 2)) * [1.0, 0.1]
    tau = Y @ np.array([50.0, 0.2]) + 5.0 * rng.normal(size=(60, 1))
    moments = Moments.of(Y, tau, np.ones((60, 1)))
    ridge, weighed = weighed_prior(WeightedLeastSquares().solve, moments, GaussianPrior(np.eye(2), np.zeros(2)), 20.0)
    values, _ = WeightedLeastSquares().solve(moments.pulled(weighed), ridge)
    assert values[0] == pytest.approx(50.0, rel=0.1)
    assert abs(values[1]) < 1.5

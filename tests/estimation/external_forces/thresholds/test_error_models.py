"""The variance of a healthy residual, recovered."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from estimation.external_forces.thresholds.error_models import ErrorModel, fit_error_model


def samples(exact, seed=0, count=40_000, beyond=0.0):
    rng = np.random.default_rng(seed)
    dq, friction = rng.uniform(-1, 1, (count, 3)), rng.uniform(-4, 4, (count, 3))
    variance = np.where(rng.random((count, 3)) < 0.1, beyond, 0.0)
    truth = ErrorModel(
        level=np.array([0.04, 0.09, 0.01]),
        reversal=np.array([1.0, 0.0, 0.5]),
        friction=np.array([0.0, 0.01, 0.02]),
        width=np.full(3, 0.1),
        growth=np.array([2.0, 1.0, 0.0]),
        reach=np.full(3, 0.3),
        coulomb=np.array([2.0, 2.0, 1.0]),
        correlation=np.array([[1.0, 0.6, 0.0], [0.6, 1.0, 0.0], [0.0, 0.0, 1.0]]),
    )
    z = rng.multivariate_normal(np.zeros(3), truth.correlation, count)
    deviation = truth.deviation(truth.amplitudes(dq, friction, variance))
    known = {"band_covariance": [], "band_growth": truth.growth.tolist(), "band_reach": truth.reach.tolist()}
    return replace(exact, provenance=known), truth, z * deviation, dq, friction, variance


@pytest.mark.slow
def test_variances_and_correlation_are_recovered(exact):
    """Level, reversal, friction share and correlation of 20,000 independent rows are those that made them.

    A variance of so many rows scatters by 1 %, the coefficients by a few; the width is one of eight on a grid.
    """
    model, truth, residual, dq, friction, variance = samples(exact)
    counts = np.ones(len(dq), dtype=bool)
    found = fit_error_model(model, residual, dq, friction, variance, counts, lambda x: x)
    np.testing.assert_allclose(found.level, truth.level, rtol=0.15)
    np.testing.assert_allclose(found.friction, truth.friction, atol=1.5e-3)
    np.testing.assert_allclose(found.correlation, truth.correlation, atol=0.03)
    # Three degrees of freedom.
    deviation = found.deviation(found.amplitudes(dq, friction, variance))
    assert found.statistic(residual, deviation).mean() == pytest.approx(3.0, abs=0.1)
    # Near reversals, of some 4000 rows, whichever width on the grid was taken.
    z = (residual / deviation)[:, 0]
    assert np.mean(z[np.abs(dq[:, 0]) < 0.1] ** 2) == pytest.approx(1.0, abs=0.15)


@pytest.mark.slow
def test_rows_beyond_the_reach_are_not_taken_for_noise(exact):
    """A tenth of the rows with errors of the parameters beyond the reach leaves the level as it is."""
    model, truth, residual, dq, friction, variance = samples(exact, beyond=0.25)
    found = fit_error_model(model, residual, dq, friction, variance, np.ones(len(dq), dtype=bool), lambda x: x)
    np.testing.assert_allclose(found.level, truth.level, rtol=0.15)


@pytest.mark.slow
def test_rows_of_the_fit_get_the_parameters_errors_on_top(exact):
    """Of a log that the model was fitted to, the parameters' errors count at any motion, not beyond the reach alone."""
    model, _, residual, dq, friction, variance = samples(exact, count=4000)
    counts = np.ones(len(dq), dtype=bool)
    seen = fit_error_model(model, residual, dq, friction, variance, counts, lambda x: x, in_fit=True)
    assert (seen.reach == 0).all()
    unseen = fit_error_model(model, residual, dq, friction, variance, counts, lambda x: x)
    known = np.full((1, 3), 0.05)
    at = np.ones((1, 3))
    assert (seen.amplitudes(at, at, known)[0, 2, :2] > 0).all()
    assert (unseen.amplitudes(at, at, known)[0, 2] == 0).all()


def test_resting_joint_may_hold_its_coulomb_friction(exact):
    """At rest the deviation is that of a torque anywhere between plus and minus Coulomb friction: a third squared."""
    _, truth, *_ = samples(exact, count=1)
    w = truth.amplitudes(np.zeros((1, 3)), np.zeros((1, 3)), np.zeros((1, 3)))
    expected = truth.level + truth.reversal + truth.coulomb**2 / 3
    np.testing.assert_allclose(truth.deviation(w)[0] ** 2, expected, rtol=1e-12)


def test_plain_data_reads_back(exact):
    """What is written is read."""
    _, truth, *_ = samples(exact, count=1)
    again = ErrorModel.from_dict(truth.to_dict())
    assert again.to_dict() == truth.to_dict()

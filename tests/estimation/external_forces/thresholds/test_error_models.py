"""The variance of a healthy residual, recovered."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from estimation.external_forces.thresholds.error_models import PRIOR_SECONDS, ErrorModel, fit_error_model


def samples(exact, seed=0, count=40_000, beyond=0.0):
    rng = np.random.default_rng(seed)
    dq, friction = rng.uniform(-1, 1, (count, 3)), rng.uniform(-4, 4, (count, 3))
    variance = np.where(rng.random((count, 3)) < 0.1, beyond, 0.0)
    truth = ErrorModel(
        level=np.array([0.04, 0.09, 0.01]),
        reversal=np.array([1.0, 0.0, 0.5]),
        friction=np.array([0.0, 0.01, 0.02]),
        width=np.full(3, 0.1),
        leverage=np.array([2.0, 1.0, 0.0]),
        inside=np.zeros(3),
        beyond=np.zeros(3),
        reach=np.zeros(3),
        coulomb=np.array([2.0, 2.0, 1.0]),
        holding=np.full(3, 1e-3),
        correlation=np.array([[1.0, 0.6, 0.0], [0.6, 1.0, 0.0], [0.0, 0.0, 1.0]]),
    )
    z = rng.multivariate_normal(np.zeros(3), truth.correlation, count)
    deviation = truth.deviation(truth.amplitudes(dq, friction, variance))
    known = {"band_covariance": [], "band_growth": [3.0, 2.0, 0.0]}
    return replace(exact, provenance=known), truth, z * deviation, dq, friction, variance


@pytest.mark.slow
def test_variances_and_correlation_are_recovered(exact):
    """Level, reversal, friction share and correlation of 20,000 independent rows are those that made them.

    A variance of so many rows scatters by 1 %, the coefficients by a few; the width is one of eight on a grid.
    """
    model, truth, residual, dq, friction, variance = samples(exact)
    counts = np.ones(len(dq), dtype=bool)
    found = fit_error_model(model, residual, dq, friction, variance, counts, lambda x: x, seconds=60.0)
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
def test_what_healthy_logs_show_of_the_parameters_errors_is_recovered(exact):
    """Where the residual grows with the parameters' variance, leverage is by how much, and the level stays as it is.

    A tenth of 20,000 rows has the larger variance: the mean of 2000 squares scatters by 3 %. The level
    takes a part of it.
    """
    model, truth, residual, dq, friction, variance = samples(exact, beyond=0.25)
    counts = np.ones(len(dq), dtype=bool)
    found = fit_error_model(model, residual, dq, friction, variance, counts, lambda x: x, seconds=60.0)
    np.testing.assert_allclose(found.level, truth.level, rtol=0.15)
    np.testing.assert_allclose(found.leverage, truth.leverage, rtol=0.2, atol=0.05)


@pytest.mark.slow
def test_band_of_other_motions_counts_less_the_more_healthy_motion_there_is(exact):
    """Without new motion the band counts in full; with `PRIOR_SECONDS` half of its variance; beyond it in full."""
    model, _, residual, dq, friction, variance = samples(exact, count=4000, beyond=0.04)
    counts, growth = np.ones(len(dq), dtype=bool), np.array([3.0, 2.0, 0.0])
    for seconds, share in ((0.0, 1.0), (PRIOR_SECONDS, 0.5)):
        found = fit_error_model(model, residual, dq, friction, variance, counts, lambda x: x, seconds=seconds)
        np.testing.assert_allclose(found.inside, share * growth**2)
        # The largest variance in these logs is the reach; twice that adds a variance of growth^2 times it.
        np.testing.assert_allclose(found.reach, 0.2)
        near, far = (found.parameter_amplitude(np.full((1, 3), v)) ** 2 for v in (0.04, 0.08))
        np.testing.assert_allclose(far - near, 0.04 * (found.leverage + growth**2)[None], rtol=1e-9)
        seen = found.seen.parameter_amplitude(np.full((1, 3), 0.08)) ** 2
        np.testing.assert_allclose(seen, 0.08 * found.leverage[None], rtol=1e-9)


def test_widths_that_no_sample_comes_near_have_no_weight(exact):
    """Joints that never slow down below half their speed: narrow reversals are not seen, and the fit is finite."""
    model, _, residual, dq, friction, variance = samples(exact, count=600)
    fast = np.where(dq < 0, -1.0, 1.0) * np.clip(np.abs(dq), 0.5, None)
    counts = np.ones(len(dq), dtype=bool)
    found = fit_error_model(model, residual, fast, friction, variance, counts, lambda x: x, seconds=0.0)
    assert all(np.isfinite(values).all() for values in found.to_dict().values())


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

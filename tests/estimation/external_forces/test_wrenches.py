"""Loads at the tool by generalised least squares."""

from __future__ import annotations

import numpy as np

from estimation.external_forces.wrenches import misfit, tool_load


def case(seed, n=6, rows=3, samples=4000):
    rng = np.random.default_rng(seed)
    jacobian = rng.normal(size=(rows, n))
    root = rng.normal(size=(n, n))
    covariance = root @ root.T / n + 0.1 * np.eye(n)
    load = rng.normal(size=rows) * 5
    noise = rng.multivariate_normal(np.zeros(n), covariance, samples)
    residual = jacobian.T @ load + noise
    return (np.broadcast_to(x, (samples, *x.shape)) for x in (covariance, jacobian, load)), residual


def test_load_and_covariance_are_those_of_the_linear_model():
    """Over 4000 draws the mean is the true load, and the scatter is the stated covariance.

    The mean is off by more than five standard errors with a chance of 2e-6; a variance of 4000 draws scatters by 2.2 %,
    and 12 % are more than five of those.
    """
    (covariance, jacobian, load), residual = case(0)
    found, spread = tool_load(residual, covariance, jacobian)
    deviation = np.sqrt(np.diag(spread[0]))
    assert (np.abs(found.mean(axis=0) - load[0]) < 5 * deviation / np.sqrt(len(found))).all()
    np.testing.assert_allclose(found.var(axis=0), np.diag(spread[0]), rtol=0.12)
    # n - k = 3 degrees of freedom; the mean of 4000 chi-squared values scatters by 0.039.
    assert abs(misfit(residual, covariance, jacobian).mean() - 3.0) < 0.2


def test_direction_that_no_joint_feels_has_an_infinite_variance():
    """Two joints in a plane do not feel a force across it, and the other components are as without it."""
    jacobian = np.array([[[1.0, 0.5], [0.2, 0.9], [0.0, 0.0]]])
    residual, covariance = np.array([[1.4, 2.3]]), np.eye(2)[None]
    found, spread = tool_load(residual, covariance, jacobian)
    np.testing.assert_allclose(found[0, :2], np.linalg.solve(jacobian[0, :2].T, residual[0]), rtol=1e-9)
    assert found[0, 2] == 0.0
    assert np.isfinite(np.diag(spread[0])).tolist() == [True, True, False]

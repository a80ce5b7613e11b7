"""The body that can exist and suits a least-squares payload."""

from __future__ import annotations

import cvxpy
import numpy as np
import pytest

from estimation.payloads.body import Body
from estimation.payloads.physical import ball, physical_body
from robots.consistency import BASIS, normalised_eigenvalues

TRUTH = Body.of(1.0, [0.02, -0.03, 0.1], np.diag([0.003, 0.004, 0.002])).parameters
SPREAD = np.array([0.01, *[0.001] * 3, *[0.002] * 6])


def test_well_determined_parameters_stay_where_the_data_have_them() -> None:
    """With errors of a thousandth the prior moves no parameter by more than a standard deviation."""
    covariance = np.diag((1e-3 * SPREAD) ** 2)
    found = physical_body(TRUTH, covariance)
    np.testing.assert_array_equal(found.nearest, TRUTH)
    assert found.distance == 0.0
    assert not found.contradicted
    assert (np.abs(found.parameters - TRUTH) < 1e-3 * SPREAD).all()


@pytest.mark.parametrize("seed", range(4))
def test_the_nearest_body_is_that_of_another_solver(seed: int) -> None:
    """Another formulation, through cvxpy, minimises the same distance over the same cone to a per cent."""
    values = np.random.default_rng(seed).multivariate_normal(TRUTH, np.diag((2 * SPREAD) ** 2))
    found = physical_body(values, np.diag(SPREAD**2))
    x = cvxpy.Variable(10)
    pseudo = sum(x[k] * BASIS[k] for k in range(10))
    problem = cvxpy.Problem(cvxpy.Minimize(cvxpy.sum_squares((x - values) / SPREAD)), [pseudo >> 0])
    problem.solve(solver=cvxpy.CLARABEL)
    # Ours keeps a millionth away from the cone's edge.
    assert found.distance == pytest.approx(problem.value, rel=0.01, abs=1e-3)


@pytest.mark.parametrize("seed", range(10))
def test_the_result_can_exist_and_is_no_surprise(seed: int) -> None:
    """Inertias that noise hides come out as a body's, within the errors; a real payload is not contradicted."""
    values = np.random.default_rng(seed).multivariate_normal(TRUTH, np.diag(SPREAD**2))
    found = physical_body(values, np.diag(SPREAD**2))
    assert (normalised_eigenvalues(found.parameters) > 0).all()
    # Of ten draws none is contradicted but with a chance of 1 in 100.
    assert not found.contradicted
    # Mass and centre hardly move.
    assert (np.abs(found.parameters[:4] - values[:4]) < 3 * SPREAD[:4]).all()


def test_open_moments_are_those_of_a_ball_of_usual_density() -> None:
    """If nothing is known of the inertia, mass and centre stay and the moments are those of the ball."""
    covariance = np.diag(np.array([0.01, *[0.001] * 3, *[10.0] * 6]) ** 2)
    found = Body(physical_body(TRUTH, covariance).parameters)
    expected = Body(ball(TRUTH))
    np.testing.assert_allclose(np.diag(found.inertia), np.diag(expected.inertia), rtol=0.05)
    np.testing.assert_allclose(found.centre, expected.centre, atol=3e-3)


def test_what_no_body_can_have_is_said() -> None:
    """Moments of inertia that are negative by ten standard deviations contradict every body."""
    values = TRUTH.copy()
    values[[4, 7, 9]] -= 0.03
    found = physical_body(values, np.diag(SPREAD**2))
    assert found.contradicted
    assert (normalised_eigenvalues(found.nearest) > 0).all()

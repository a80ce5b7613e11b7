"""Tests of the bodies nearest to a linear estimate, against cvxpy's modelling and closed forms."""

from __future__ import annotations

import cvxpy as cp
import numpy as np
import pytest

from robots.consistency import pseudo_inertia
from robots.terms.effect_bases.carried_bodies import (
    is_body,
    nearest_body,
    nearest_point_mass,
    point_mass_rows,
    point_mass_tangent,
)

# Torque per kg, kg m and kg m2 of a usual motion, up to rotations.
SIZES = np.array([5.0, 50.0, 50.0, 50.0, 30.0, 30.0, 30.0, 30.0, 30.0, 30.0])


def regression(seed: int, mass: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Draws a matrix (10, 10) and the target of a box of some mass, with much noise; also returns the box (10,)."""
    rng = np.random.default_rng(seed)
    sides, centre = rng.uniform(0.05, 0.2, 3), rng.uniform(-0.1, 0.2, 3)
    about = np.diag((sides @ sides - sides**2) / 12.0)
    inertia = mass * (about + centre @ centre * np.eye(3) - np.outer(centre, centre))
    box = np.array([mass, *(mass * centre), *inertia[np.triu_indices(3)]])
    matrix = np.linalg.qr(rng.normal(size=(10, 10)))[0] * SIZES
    return matrix, matrix @ box + rng.normal(size=10), box


@pytest.mark.parametrize("mass", [1e-6, 0.2, -0.2, 3.0])
def test_the_nearest_body_is_the_optimum_of_both_cones(mass: float) -> None:
    """No body, picked up or put down, fits better than the one returned, by cvxpy's solution of both cones."""
    for seed in range(6):
        matrix, target, _ = regression(seed, mass)
        found = nearest_body(matrix, target)
        costs = []
        for sign in (1.0, -1.0):
            variable = cp.Variable(10)
            pseudo = sum(variable[k] * pseudo_inertia(np.eye(10)[k]) for k in range(10))
            scale = np.diag([10.0, 10.0, 10.0, 1.0])
            problem = cp.Problem(
                cp.Minimize(cp.sum_squares(matrix @ variable - target)), [sign * scale @ pseudo @ scale >> 0]
            )
            costs.append(problem.solve(solver="CLARABEL"))
        # Both solvers stop at relative gaps of 1e-8.
        assert np.sum((matrix @ found - target) ** 2) == pytest.approx(min(costs), rel=1e-4, abs=1e-6)
        assert is_body(found)


@pytest.mark.parametrize("mass", [1e-3, 0.5, -2.0])
def test_a_body_without_noise_is_found(mass: float) -> None:
    """A body, and a point mass, that explain the torque fully are found, to a hundredth of its standard deviation."""
    matrix, _, box = regression(3, mass)
    np.testing.assert_allclose(matrix @ nearest_body(matrix, matrix @ box), matrix @ box, atol=0.01)
    point = mass * np.array([1.0, 0.03, -0.07, 0.11, *inertia_of(np.array([0.03, -0.07, 0.11]))])
    np.testing.assert_allclose(matrix @ nearest_point_mass(matrix, matrix @ point), matrix @ point, atol=0.01)


def inertia_of(centre: np.ndarray) -> np.ndarray:
    """Inertia (6,) of a unit mass at a centre [m2]."""
    return (centre @ centre * np.eye(3) - np.outer(centre, centre))[np.triu_indices(3)]


def test_the_tangent_is_the_derivative_of_a_point_mass() -> None:
    """Differences of point masses near each other are the tangent times the differences of mass and centre."""
    centre, step = np.array([0.03, -0.07, 0.11]), 1e-6
    at = np.array([0.7, *centre])

    def parameters(values: np.ndarray) -> np.ndarray:
        return values[0] * np.array([1.0, *values[1:], *inertia_of(values[1:])])

    numeric = [(parameters(at + step * e) - parameters(at - step * e)) / (2 * step) for e in np.eye(4)]
    np.testing.assert_allclose(point_mass_tangent(parameters(at)), np.transpose(numeric), atol=1e-9)
    assert is_body(parameters(at))
    assert is_body(-parameters(at))
    assert not is_body(np.array([1.0, 0.1, 0.0, 0.0, 0.0, 0.0, 0.0, 0.005, 0.0, 0.01]))


def test_own_moments_of_inertia_are_those_of_a_rod_from_the_flange() -> None:
    """The rows are zero for changes of mass and centre; a rod has one of each unit about its two cross axes."""
    mass, centre = 1.4, np.array([0.0, 0.0, 0.25])
    point = mass * np.array([1.0, *centre, *inertia_of(centre)])
    rows = point_mass_rows(point)
    np.testing.assert_allclose(rows @ point_mass_tangent(point), 0.0, atol=1e-9)
    # From the flange to twice the distance of its centre, about the flange: m (2 c)^2 / 3.
    rod = mass * np.array([1.0, *centre, *np.array([1.0, 0, 0, 1.0, 0, 0]) * (2 * 0.25) ** 2 / 3])
    np.testing.assert_allclose(rows @ (rod - point), [1.0, 0, 0, 1.0, 0, 0], atol=1e-9)
    np.testing.assert_allclose(point_mass_rows(-point) @ (point - rod), [-1.0, 0, 0, -1.0, 0, 0], atol=1e-9)

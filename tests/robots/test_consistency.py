"""Pseudo-inertias: which inertial parameters a body can have."""

import numpy as np
import pytest

from robots.common.errors import InputError
from robots.consistency import inertial_from_pseudo, normalised_eigenvalues, pseudo_inertia
from robots.geometry.inertia import inertial_parameters


def cloud(seed=0, points=40):
    """Point masses: mass (k,) and places (k, 3)."""
    rng = np.random.default_rng(seed)
    return rng.uniform(0.1, 1.0, points), rng.normal((0.5, -0.2, 0.1), 1.0, (points, 3))


def parameters_of(mass, place):
    """Inertial parameters by their definition, sums over the points."""
    second = np.einsum("k,ki,kj->ij", mass, place, place)
    inertia = np.trace(second) * np.eye(3) - second
    return np.concatenate([[mass.sum()], mass @ place, inertia[np.triu_indices(3)]])


def test_it_is_the_second_moment_of_mass():
    """The pseudo-inertia is the sum of m (x, 1)(x, 1)' over the body's points."""
    mass, place = cloud()
    homogeneous = np.column_stack([place, np.ones(len(mass))])
    expected = np.einsum("k,ki,kj->ij", mass, homogeneous, homogeneous)
    np.testing.assert_allclose(pseudo_inertia(parameters_of(mass, place)), expected, atol=1e-12)


def test_parameters_and_pseudo_inertia_are_the_same_thing():
    """Either gives the other back, for many bodies at once."""
    bodies = np.array([parameters_of(*cloud(seed)) for seed in range(5)]).reshape(5, 1, 10)
    assert pseudo_inertia(bodies).shape == (5, 1, 4, 4)
    np.testing.assert_allclose(inertial_from_pseudo(pseudo_inertia(bodies)), bodies, atol=1e-12)


def test_bodies_that_cannot_exist_have_a_negative_eigenvalue():
    """A negative mass, a moment beyond the triangle inequality, a centre too far out: each shows."""
    sphere = inertial_parameters(2.0, [0.1, 0.0, 0.0], 0.01 * np.eye(3), np.eye(4))
    assert (normalised_eigenvalues(sphere) > 0).all()
    assert normalised_eigenvalues(-sphere).min() < 0
    triangle = inertial_parameters(2.0, [0, 0, 0], np.diag([0.01, 0.01, 0.03]), np.eye(4))
    assert normalised_eigenvalues(triangle).min() < 0
    far = sphere.copy()
    far[1] = 1.0
    assert normalised_eigenvalues(far).min() < 0


def test_eigenvalues_are_free_of_units():
    """Grams and millimetres give the same normalised eigenvalues."""
    body = parameters_of(*cloud())
    in_grams = body * 1e3
    in_millimetres = body * np.array([1.0] + [1e3] * 3 + [1e6] * 6)
    for other in (in_grams, in_millimetres):
        np.testing.assert_allclose(normalised_eigenvalues(other), normalised_eigenvalues(body), rtol=1e-9)


def test_other_numbers_of_parameters_are_refused():
    """Ten parameters a body."""
    with pytest.raises(InputError, match="last dimension of 10"):
        pseudo_inertia(np.ones(9))

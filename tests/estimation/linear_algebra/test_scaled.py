"""Systems whose rows have different units are solved as well as those of one unit."""

import numpy as np
import pytest

from estimation.linear_algebra.scaled import floored_inverse, inverse, inverse_root, solve_ridge, square_root

UNITS = np.array([1e-6, 1.0, 1e3, 1e8])


@pytest.fixture
def gram():
    rows = np.random.default_rng(0).normal(size=(40, 4))
    return rows.T @ rows


@pytest.mark.parametrize("invert", [inverse, floored_inverse, lambda m: solve_ridge(m, np.eye(4), 0.0)])
def test_inverses_do_not_depend_on_units(gram, invert):
    """The inverse of a scaled matrix is the scaled inverse, to rounding of the matrix of one unit."""
    expected = np.linalg.inv(gram)
    found = invert(gram * UNITS[:, None] * UNITS) * UNITS[:, None] * UNITS
    np.testing.assert_allclose(found, expected, rtol=1e-10, atol=1e-14)


def test_a_ridge_counts_against_columns_of_unit_length(gram):
    """It is added to the diagonal of ones, and a column of zeros gets the value zero."""
    right = np.random.default_rng(1).normal(size=(4, 2))
    expected = np.linalg.solve(gram + 0.1 * np.diag(np.diag(gram)), right)
    np.testing.assert_allclose(solve_ridge(gram, right, 0.1), expected, rtol=1e-12)
    wider = np.pad(gram, (0, 1))
    found = solve_ridge(wider, np.append(right[:, 0], 0.0), 0.1)
    np.testing.assert_allclose(found, np.append(expected[:, 0], 0.0), rtol=1e-12)
    np.testing.assert_allclose(inverse(gram, 0.1), np.linalg.inv(gram + 0.1 * np.diag(np.diag(gram))), rtol=1e-10)


def test_a_singular_matrix_has_a_floored_inverse_and_a_root_of_the_rest(gram):
    """Of a column that is there twice, the floored inverse is positive definite, and the root leaves it out."""
    twice = gram[np.ix_([0, 1, 2, 3, 3], [0, 1, 2, 3, 3])]
    # As large as the reciprocal of rounding where nothing is known.
    assert np.linalg.eigvalsh(floored_inverse(twice))[-1] > 1e12
    root = inverse_root(twice, 1e-10)
    assert root.shape == (5, 4)
    np.testing.assert_allclose(twice @ root @ root.T @ twice, twice, atol=1e-9 * np.trace(twice))
    difference = np.array([0.0, 0.0, 0.0, 1.0, -1.0])
    np.testing.assert_allclose(difference @ root, 0.0, atol=1e-12)


def test_a_square_root_gives_the_matrix_back(gram):
    """Also of a matrix that is singular."""
    gram[:, 0] = gram[0, :] = 0.0
    found = square_root(gram)
    np.testing.assert_allclose(found @ found.T, gram, atol=1e-12 * np.trace(gram))

"""Normal equations and their inverse, where scales differ and where a parameter has no influence."""

import numpy as np

from estimation.linear_algebra.scaled import LEAST_RIDGE, solve_ridge
from estimation.thermal.information import inverse_of


def problem(scale):
    rng = np.random.default_rng(0)
    rows = rng.normal(size=(50, 4)) * scale
    return rows.T @ rows, rng.normal(size=4)


def test_scales_that_differ_by_many_orders_do_not_matter():
    """The inverse times the matrix is one, for columns from 1e-9 to 1e9."""
    matrix, right = problem(np.array([1e-9, 1.0, 1e3, 1e9]))
    scale = np.sqrt(np.diag(matrix))
    # The regularisation of 1e-12 is the only error besides rounding.
    np.testing.assert_allclose(inverse_of(matrix) @ matrix * scale[:, None] / scale, np.eye(4), atol=1e-10)
    np.testing.assert_allclose(solve_ridge(matrix, matrix @ (right / scale), LEAST_RIDGE) * scale, right, rtol=1e-9)


def test_parameter_without_influence_has_an_infinite_variance():
    """A row of zeros gives an infinite variance, without a warning, and changes no other."""
    matrix, _ = problem(np.ones(4))
    for silent in (0.0, 1e-300):
        wide = np.zeros((5, 5))
        wide[:4, :4] = matrix
        wide[4, 4] = silent
        inverse = inverse_of(wide)
        assert inverse[4, 4] == np.inf
        assert not inverse[:4, 4].any()
        np.testing.assert_allclose(inverse[:4, :4], np.linalg.inv(matrix), rtol=1e-9)

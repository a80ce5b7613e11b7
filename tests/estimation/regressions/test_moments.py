from functools import reduce
from operator import add

import numpy as np
import pytest

from estimation.regressions.moments import Moments

ROWS, JOINTS, COLUMNS = 200, 3, 7


@pytest.fixture
def problem():
    """Random rows, of which some do not count, with columns of very different size."""
    rng = np.random.default_rng(0)
    Y = rng.normal(size=(ROWS, JOINTS, COLUMNS)) * 10.0 ** rng.uniform(-2, 2, COLUMNS)
    tau = rng.normal(size=(ROWS, JOINTS))
    return Y, tau, (rng.random((ROWS, JOINTS)) < 0.8).astype(float)


def test_solving_equals_least_squares(problem):
    """Without a ridge the solution is numpy's least squares of the weighted rows that count."""
    Y, tau, mask = problem
    weights = np.array([1.0, 4.0, 0.25])
    factor = np.sqrt(weights) * mask
    rows = (Y * factor[:, :, None]).reshape(-1, COLUMNS)
    expected = np.linalg.lstsq(rows, (tau * factor).reshape(-1), rcond=None)[0]
    # Normal equations of a well-conditioned scaled problem lose a few digits of sixteen.
    np.testing.assert_allclose(Moments.of(Y, tau, mask).solve(weights, 0.0), expected, rtol=1e-9)


def test_the_inverse_is_that_of_the_weighted_gram_matrix(problem):
    """The inverse, used for standard errors, equals numpy's."""
    Y, tau, mask = problem
    weights = np.array([1.0, 4.0, 0.25])
    rows = (Y * (np.sqrt(weights) * mask)[:, :, None]).reshape(-1, COLUMNS)
    np.testing.assert_allclose(Moments.of(Y, tau, mask).inverse(weights, 0.0), np.linalg.inv(rows.T @ rows), rtol=1e-8)


def test_the_ridge_acts_on_columns_of_unit_length(problem):
    """A ridge is rows that pull each parameter, measured in its column's length, to zero: units do not matter."""
    Y, tau, mask = problem
    weights, ridge = np.ones(JOINTS), 0.1
    rows = (Y * mask[:, :, None]).reshape(-1, COLUMNS)
    pull = np.sqrt(ridge) * np.diag(np.linalg.norm(rows, axis=0))
    right = np.concatenate([(tau * mask).reshape(-1), np.zeros(COLUMNS)])
    expected = np.linalg.lstsq(np.vstack([rows, pull]), right, rcond=None)[0]
    np.testing.assert_allclose(Moments.of(Y, tau, mask).solve(weights, ridge), expected, rtol=1e-9)


def test_parts_add_to_the_whole_and_take_away_again(problem):
    """Moments of blocks sum to those of all rows; taking one away leaves those of the rest."""
    Y, tau, mask = problem
    blocks = [Moments.of(Y[i], tau[i], mask[i]) for i in np.array_split(np.arange(ROWS), 4)]
    whole = Moments.of(Y, tau, mask)
    rest = Moments.of(Y[50:], tau[50:], mask[50:])
    for found, expected in ((reduce(add, blocks), whole), (whole - blocks[0], rest)):
        for name in ("gram", "cross", "square", "count"):
            a, b = getattr(found, name), getattr(expected, name)
            np.testing.assert_allclose(a, b, rtol=1e-12, atol=1e-12 * np.abs(b).max())


def test_residuals_are_those_of_the_rows(problem):
    """The residual sum and level of any parameters equal those of the rows themselves."""
    Y, tau, mask = problem
    parameters = np.random.default_rng(1).normal(size=COLUMNS)
    squares = (mask * (tau - Y @ parameters) ** 2).sum(axis=0)
    moments = Moments.of(Y, tau, mask)
    np.testing.assert_allclose(moments.residual(parameters), squares, rtol=1e-9)
    np.testing.assert_allclose(moments.level(parameters), np.sqrt(squares / mask.sum(axis=0)), rtol=1e-9)


def test_columns_can_be_chosen(problem):
    """Leaving columns out gives the moments of the remaining ones."""
    Y, tau, mask = problem
    chosen = np.array([4, 0, 2])
    found = Moments.of(Y, tau, mask).columns(chosen)
    expected = Moments.of(Y[:, :, chosen], tau, mask)
    np.testing.assert_allclose(found.gram, expected.gram, rtol=1e-12)
    np.testing.assert_allclose(found.cross, expected.cross, rtol=1e-12)


def test_a_column_that_never_acts_gets_zero(problem):
    """A parameter without any excitation is zero, and the others are as without it."""
    Y, tau, mask = problem
    Y = Y.copy()
    Y[:, :, 3] = 0.0
    moments = Moments.of(Y, tau, mask)
    found = moments.solve(np.ones(JOINTS), 1e-10)
    assert found[3] == 0.0
    others = np.delete(np.arange(COLUMNS), 3)
    expected = moments.columns(others).solve(np.ones(JOINTS), 1e-10)
    np.testing.assert_allclose(found[others], expected, rtol=1e-9)


def test_an_exact_fit_has_a_level_above_zero():
    """The level of an exact fit is floored: its inverse is used as a weight."""
    Y = np.random.default_rng(0).normal(size=(50, 1, 2))
    moments = Moments.of(Y, Y @ np.array([1.0, 2.0]), np.ones((50, 1)))
    level = moments.level(np.array([1.0, 2.0]))
    assert 0 < level[0] <= 1.01e-3 * np.sqrt(moments.square[0] / 50)

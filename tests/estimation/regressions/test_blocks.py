import numpy as np
import pytest

from estimation.regressions.blocks import Blocks, side_products
from estimation.regressions.moments import Moments
from estimation.regressions.parameter_priors import GaussianPrior

ROWS, JOINTS, COLUMNS, BLOCKS = 240, 3, 7, 4
WEIGHTS = np.array([1.0, 4.0, 0.25])


def filled(Y, tau, places):
    """The normal equations of some blocks of rows."""
    blocks = Blocks.empty(JOINTS, len(places), Y.shape[2])
    for k, place in enumerate(places):
        moments = Moments.of(Y[place], tau[place], np.ones((len(place), JOINTS)))
        for name in ("gram", "cross", "square", "count"):
            getattr(blocks, name)[:, k] = getattr(moments, name)
    return blocks


@pytest.fixture
def problem():
    """Random rows in blocks, with columns of very different size, and their normal equations."""
    rng = np.random.default_rng(0)
    Y = rng.normal(size=(ROWS, JOINTS, COLUMNS)) * 10.0 ** rng.uniform(-2, 2, COLUMNS)
    tau = rng.normal(size=(ROWS, JOINTS))
    places = np.array_split(np.arange(ROWS), BLOCKS)
    return Y, tau, places, filled(Y, tau, places)


def least_squares(Y, tau, weights=WEIGHTS):
    root = np.sqrt(weights)
    return np.linalg.lstsq((Y * root[:, None]).reshape(-1, Y.shape[2]), (tau * root).reshape(-1), rcond=None)[0]


def test_each_block_is_left_out_in_turn(problem):
    """The parameters without a block are numpy's least squares of the other blocks' rows."""
    Y, tau, places, blocks = problem
    for found, place in zip(blocks.without(WEIGHTS, 0.0, None), places, strict=True):
        rest = np.setdiff1d(np.arange(ROWS), place)
        # Normal equations of a well-conditioned scaled problem, by a difference of sums, lose a few digits of sixteen.
        np.testing.assert_allclose(found, least_squares(Y[rest], tau[rest]), rtol=1e-8)


def test_a_single_block_is_predicted_by_itself(problem):
    """Where nothing else is there, a block's own fit has to do."""
    Y, tau, _, _ = problem
    alone = filled(Y, tau, [np.arange(ROWS)])
    np.testing.assert_allclose(alone.without(WEIGHTS, 0.0, None)[0], least_squares(Y, tau), rtol=1e-8)


def test_squares_are_those_of_the_errors(problem):
    """The sums of squares equal those of the rows' own errors, each block by its own parameters."""
    Y, tau, places, blocks = problem
    values = np.random.default_rng(1).normal(size=(BLOCKS, COLUMNS))
    expected = sum(((tau[i] - Y[i] @ v) ** 2).sum(axis=0) for i, v in zip(places, values, strict=True))
    np.testing.assert_allclose(blocks.squares(values), expected, rtol=1e-9)


@pytest.mark.parametrize("ridge", [1e-6, 1e-2])
@pytest.mark.parametrize("pulled", [False, True])
def test_ridge_and_pull_are_those_of_the_moments(problem, ridge, pulled):
    """A block's rest is solved as `Moments.solve` solves it."""
    Y, tau, places, blocks = problem
    rng = np.random.default_rng(2)
    root = rng.normal(size=(COLUMNS, COLUMNS))
    pull = GaussianPrior(root @ root.T, rng.normal(size=COLUMNS)) if pulled else None
    for found, place in zip(blocks.without(WEIGHTS, ridge, pull), places, strict=True):
        rest = np.setdiff1d(np.arange(ROWS), place)
        moments = Moments.of(Y[rest], tau[rest], np.ones((len(rest), JOINTS))).pulled(pull)
        np.testing.assert_allclose(found, moments.solve(WEIGHTS, ridge), rtol=1e-7)


def test_some_columns_are_those_of_rows_without_the_others(problem):
    """Choosing columns is the same as never having had the others."""
    Y, tau, places, blocks = problem
    chosen = [0, 2, 5]
    found = blocks.columns(chosen)
    expected = filled(Y[:, :, chosen], tau, places)
    for name in ("gram", "cross", "square", "count"):
        np.testing.assert_allclose(getattr(found, name), getattr(expected, name), rtol=1e-12)
    assert blocks.columns(chosen) is found


def test_choices_of_columns_are_fitted_one_by_one(problem):
    """Each choice's parameters are least squares with its columns alone, every joint alike, and zero elsewhere."""
    Y, tau, _, blocks = problem
    choices = np.array([[0, 1, 2, 3], [0, 1, 5, 3], [6, 1, 2, 4]])
    for _ in range(2):  # what is kept from the first time changes nothing
        for values, chosen in zip(blocks.fitted(choices, 0.0, None), choices, strict=True):
            np.testing.assert_allclose(values[chosen], least_squares(Y[:, :, chosen], tau, np.ones(JOINTS)), rtol=1e-8)
            assert not np.delete(values, chosen).any()


@pytest.mark.parametrize("size", [1, 5])
@pytest.mark.parametrize("counted", [1.0, 0.9, 0.0])
def test_products_are_those_of_averaged_rows(size, counted):
    """Of two sides that leave out other rows, averaged by a loop; the second leaves out few."""
    rng = np.random.default_rng(3)
    rows = rng.normal(size=(60, 8))
    sides = [(rng.random(60) < share).astype(float) for share in (counted, 0.97)]
    sums, left_out = rows.reshape(-1, size, 8).sum(axis=1), []
    for weight in sides:
        missing = (1 - weight)[:, None] * rows
        places = np.flatnonzero((weight.reshape(-1, size) != 1).any(axis=1))
        left_out.append((places, missing.reshape(-1, size, 8).sum(axis=1)[places]))
    for found, weights in zip(side_products(sums, left_out, size), sides, strict=True):
        means = [sum(weights[i] * rows[i] for i in range(g, g + size)) / size for g in range(0, 60, size)]
        np.testing.assert_allclose(found, sum(np.outer(mean, mean) for mean in means), rtol=1e-9, atol=1e-12)

import numpy as np
import pytest

from estimation.regressions.joint_regressor import JointRegressor, summed
from estimation.regressions.moments import Moments
from robots.base_parameters import find_base_parameters
from robots.common.stretches import chunks
from robots.regressor import default_model


@pytest.fixture(scope="module")
def base(arm):
    return find_base_parameters(default_model(arm, velocity_scale=0.01))


@pytest.fixture
def states():
    return np.random.default_rng(0).normal(size=(3, 300, 2))


def test_each_joints_rows_are_those_of_the_regressor(base, states):
    """The parts hold the regressor's columns that act on a joint, and the others are zero."""
    Y = base.regressor(*states)
    regressor = JointRegressor(base)
    for joint, (rows, used) in enumerate(zip(regressor(*states), regressor.used, strict=True)):
        # The same expressions, compiled twice.
        np.testing.assert_allclose(rows, Y[:, joint, used], rtol=1e-12, atol=1e-12)
        assert not np.delete(Y[:, joint], used, axis=1).any()


def test_moments_and_torque_are_those_of_dense_rows(base, states):
    """Normal equations and torque equal those of the whole regressor, rows that do not count left out."""
    rng = np.random.default_rng(1)
    tau, values = rng.normal(size=(300, 2)), rng.normal(size=base.size)
    mask = (rng.random((300, 2)) < 0.9).astype(float)
    regressor = JointRegressor(base)
    found, expected = regressor.moments(*states, tau, mask), Moments.of(base.regressor(*states), tau, mask)
    for name in ("gram", "cross", "square", "count"):
        a, b = getattr(found, name), getattr(expected, name)
        np.testing.assert_allclose(a, b, rtol=1e-10, atol=1e-10 * np.abs(b).max())
    np.testing.assert_allclose(regressor.torque(*states, values), base.torque(*states, values), rtol=1e-10, atol=1e-10)


@pytest.mark.parametrize("share", [1.0, 0.9, 0.0])
@pytest.mark.parametrize("size", [1, 6])
def test_rows_are_summed_over_groups(base, states, share, size):
    """Sums over groups of samples, of all and of those that count, are those of each joint's rows."""
    mask = (np.random.default_rng(2).random((300, 2)) < share).astype(float)
    regressor = JointRegressor(base)
    sums, counted = regressor.sums(*states, size), regressor.counted(*states, mask, size)
    for joint, rows in enumerate(regressor(*states)):
        for found, weights in ((sums[joint], np.ones(300)), (counted[joint], mask[:, joint])):
            expected = (weights[:, None] * rows).reshape(300 // size, size, -1).sum(axis=1)
            np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-11)


def test_rows_of_a_group_are_summed():
    """Groups that are not there are left out, and no rows give no groups."""
    places, sums = summed(np.arange(8.0).reshape(4, 2), np.array([0, 2, 2, 5]))
    assert places.tolist() == [0, 2, 5]
    assert sums.tolist() == [[0, 1], [6, 8], [6, 7]]
    places, sums = summed(np.empty((0, 2)), np.empty(0, dtype=np.intp))
    assert places.shape == (0,)
    assert sums.shape == (0, 2)


def test_chunks_cover_all_rows_once():
    """Slices follow each other, the last one short."""
    assert [(c.start, c.stop) for c in chunks(5, 2)] == [(0, 2), (2, 4), (4, 5)]

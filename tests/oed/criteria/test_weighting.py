"""Rows, columns and prior information: what a criterion judges, against plain linear algebra."""

from __future__ import annotations

import numpy as np
import pytest

from oed.criteria import Prior, Weighting, criterion, nominal_scale, task_transform
from robots.base_parameters import find_base_parameters
from robots.common.errors import InputError
from robots.loading import load_robot
from robots.regressor import default_model

M = 6


@pytest.fixture
def gram():
    root = np.random.default_rng(1).normal(size=(40, M)) * np.array([1.0, 3.0, 0.2, 1.0, 5.0, 0.7])
    return root.T @ root


def weightings(rng):
    square = rng.normal(size=(M, M))
    return {
        "plain": Weighting(),
        "columns": Weighting(transform=rng.uniform(0.5, 2.0, M)),
        "directions": Weighting(transform=square),
        "unit": Weighting(unit_columns=True),
        "prior": Weighting(prior=square @ square.T, amount=3.0),
        "all": Weighting(transform=rng.uniform(0.5, 2.0, M), unit_columns=True, prior=square @ square.T, amount=3.0),
    }


@pytest.mark.parametrize("name", ["plain", "columns", "directions", "unit", "prior", "all"])
def test_the_gradient_goes_through_the_weighting(name, gram):
    """The pullback is the derivative of the criterion by the unweighted information, by central differences."""
    rng = np.random.default_rng(2)
    weighting, cond = weightings(rng)[name], criterion("cond")

    def value(matrix):
        return cond.surrogate(np.linalg.eigvalsh(weighting.apply(matrix)), 4.0)[0]

    eigenvalues, vectors = np.linalg.eigh(weighting.apply(gram))
    slope = (vectors * cond.surrogate(eigenvalues, 4.0)[1]) @ vectors.T
    pulled = weighting.pullback(slope, gram)
    direction = rng.normal(size=(M, M))
    direction = direction + direction.T
    step = 1e-5
    numeric = (value(gram + step * direction) - value(gram - step * direction)) / (2 * step)
    # central differences of a function of size 1 at this step are good to some 1e-9
    assert np.sum(pulled * direction) == pytest.approx(numeric, rel=1e-5, abs=1e-9)


@pytest.mark.parametrize("name", ["plain", "columns", "directions", "unit", "prior", "all"])
def test_singular_values_are_the_roots_of_the_eigenvalues(name, gram):
    """The accurate way through a triangle gives what the information matrix gives."""
    weighting = weightings(np.random.default_rng(2))[name]
    samples = 10
    triangle = np.linalg.cholesky(gram).T
    mean = gram / samples if weighting.prior is not None else gram
    expected = np.sqrt(np.linalg.eigvalsh(weighting.apply(mean)))
    np.testing.assert_allclose(weighting.singular_values(triangle, samples), expected, rtol=1e-8)


@pytest.fixture(scope="module")
def base():
    robot = load_robot("er3a")
    return find_base_parameters(default_model(robot, friction="coulomb-viscous", velocity_scale=0.02, offset=False))


def test_the_task_turns_a_into_i(base):
    """trace(T G^-1) is the mean variance of the torques predicted on the task, computed row by row."""
    rng = np.random.default_rng(3)
    motion = rng.uniform(-1, 1, (3, 300, 6))
    task = rng.uniform(-1, 1, (3, 200, 6))
    Y = base.regressor(*motion).reshape(-1, base.size)
    weighting = Weighting(transform=task_transform(base, *task))
    eigenvalues = np.linalg.eigvalsh(weighting.apply(Y.T @ Y))
    covariance = np.linalg.inv(Y.T @ Y)
    rows = base.regressor(*task).reshape(-1, base.size)
    variance = np.einsum("ri,ij,rj->", rows, covariance, rows) / 200
    # directions that the task hardly uses are floored at 1e-8 of the largest
    assert criterion("i").value(eigenvalues) == pytest.approx(variance, rel=1e-3)


def test_nominal_sizes_make_torques(base):
    """A column times its nominal size is a torque; sizes are positive, a vanishing one is replaced by a small one."""
    scale = nominal_scale(base)
    nominal = np.abs(base.from_standard(base.model.nominal))
    assert (scale > 0).all()
    large = nominal > 0.5 * nominal.max()
    np.testing.assert_allclose(scale[large], nominal[large])


def test_a_prior_is_the_inverse_covariance():
    """What an earlier model knows of shared parameters, the others integrated out; nothing of the undetermined."""
    rng = np.random.default_rng(4)
    root = rng.normal(size=(3, 3))
    covariance = root @ root.T + np.eye(3)
    prior = Prior(names=("a", "b", "c"), covariance=covariance, noise=np.ones(2))
    information = prior.information(("c", "x", "a"))
    expected = np.linalg.inv(covariance[np.ix_([2, 0], [2, 0])])
    np.testing.assert_allclose(information[np.ix_([0, 2], [0, 2])], expected)
    assert not information[1].any()
    lost = covariance.copy()
    lost[0, 0] = np.inf
    known = Prior(names=("a", "b", "c"), covariance=lost, noise=np.ones(2)).information(("c", "x", "a"))
    assert not known[2].any()
    assert known[0, 0] == pytest.approx(1 / covariance[2, 2])


def test_a_prior_of_another_robot_is_refused():
    """A model without a common parameter has no information."""
    with pytest.raises(InputError, match="no parameter in common"):
        Prior(names=("a",), covariance=np.eye(1), noise=np.ones(1)).information(("b",))

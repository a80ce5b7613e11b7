"""Tests of the regularisation of effects' coefficients by empirical Bayes, and of gains per joint."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from estimation.diagnosis.hypothesis_tests.fitted_effects import FittedEffect
from estimation.diagnosis.hypothesis_tests.problem import Group
from estimation.diagnosis.hypothesis_tests.scoring import Score, visible_root
from estimation.diagnosis.joint_fits.shrinkage import shrinkage_precision
from estimation.regressions.moments import Moments
from estimation.regressions.parameter_priors import GaussianPrior


def _score(X: np.ndarray, base: np.ndarray, y: np.ndarray) -> Score:
    """Computes the score of columns beside a base model, for noise of unit variance."""
    Q = np.linalg.qr(base)[0]
    left = X - Q @ (Q.T @ X)
    gram, raw = left.T @ left, (X**2).sum(axis=0)
    return Score(gram, left.T @ y, raw, visible_root(gram, raw), np.zeros((0, X.shape[1])))


def test_the_energy_makes_the_data_likeliest() -> None:
    """The chosen prior precision maximises the marginal likelihood of the data."""
    rng = np.random.default_rng(0)
    base, X = rng.standard_normal((300, 4)), rng.standard_normal((300, 3)) * [1.0, 5.0, 0.2]
    y = X @ [0.4, -0.05, 1.0] + base @ [3.0, 1.0, -2.0, 0.5] + rng.standard_normal(300)
    precision = shrinkage_precision(_score(X, base, y))
    Q = np.linalg.qr(base, mode="complete")[0][:, 4:]  # complement of the base model
    beside, rest = Q.T @ X, Q.T @ y

    def likelihood(scale: float) -> float:
        covariance = np.eye(len(rest)) + (beside / (scale * precision)) @ beside.T
        return float(multivariate_normal(np.zeros(len(rest)), covariance).logpdf(rest))

    best = likelihood(1.0)
    assert best > likelihood(0.8)
    assert best > likelihood(1.25)
    # The prior energy of the torque is the same for all columns.
    assert precision / (X**2).sum(axis=0) == pytest.approx(np.full(3, precision[0] / (X[:, 0] ** 2).sum()))


def test_what_is_well_measured_stays_and_what_two_columns_share_is_shared() -> None:
    """A well-determined coefficient keeps its least-squares value; two similar columns share theirs equally."""
    rng = np.random.default_rng(1)
    base = rng.standard_normal((2000, 3))
    x = np.sin(np.linspace(0, 40, 2000))
    twin = x + 0.003 * rng.standard_normal(2000)
    y = x + rng.standard_normal(2000)

    def fit(X: np.ndarray, pulled: bool) -> np.ndarray:
        Y = np.column_stack([base, X])
        own = shrinkage_precision(_score(X, base, y)) if pulled else np.zeros(X.shape[1])
        prior = GaussianPrior(np.diag([0.0, 0.0, 0.0, *own]), np.zeros(Y.shape[1]))
        return Moments.of(Y[:, None], y[:, None]).pulled(prior).posterior()[3:]

    alone = x[:, None]
    assert fit(alone, True) == pytest.approx(fit(alone, False), rel=0.01)
    both = np.column_stack([x, twin])
    free, kept = fit(both, False), fit(both, True)
    assert np.abs(free).max() > 3.0  # by chance; each should be 0.5
    assert kept == pytest.approx([0.5, 0.5], abs=0.1)


def test_a_column_that_never_acts_stays_at_zero() -> None:
    """A column of zeros keeps the coefficient zero."""
    rng = np.random.default_rng(2)
    base, X = rng.standard_normal((200, 2)), np.column_stack([rng.standard_normal(200), np.zeros(200)])
    y = 2 * X[:, 0] + rng.standard_normal(200)
    own = shrinkage_precision(_score(X, base, y))
    Y = np.column_stack([base, X])
    prior = GaussianPrior(np.diag([0.0, 0.0, *own]), np.zeros(4))
    values = Moments.of(Y[:, None], y[:, None]).pulled(prior).posterior()
    assert values[2] == pytest.approx(2.0, abs=0.4)
    assert abs(values[3]) < 1e-6


def test_a_gain_is_shared_by_the_energy_on_each_joint() -> None:
    """A gain is distributed over the joints by the energy of the torque on each."""
    rows = np.ones((100, 1), dtype=np.float32)
    group = Group((0, 2), (3 * rows, rows), np.zeros((1, 1)), np.eye(1), np.ones(1), np.ones(1))
    member = FittedEffect(SimpleNamespace(), (), group, 50.0, np.array([2.0]), 1, 1.0)
    assert [member.gain_on([j]) for j in range(3)] == pytest.approx([45.0, 0.0, 5.0])
    assert member.gain_on([0, 1, 2]) == pytest.approx(50.0)

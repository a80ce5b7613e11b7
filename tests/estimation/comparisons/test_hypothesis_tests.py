"""Chi-square tests of agreement, and Holm's adjustment."""

import numpy as np
import pytest
from scipy.stats import chi2, kstest

from estimation.comparisons.hypothesis_tests import adjust_holm, agreement_test


def test_two_runs_give_the_two_sample_statistic():
    """For two runs the statistic is d' (C1 + C2)^-1 d with d degrees of freedom (closed form)."""
    rng = np.random.default_rng(1)
    x = rng.normal(size=(2, 4))
    mixing = rng.normal(size=(2, 4, 4))
    C = mixing @ mixing.transpose(0, 2, 1) + 0.1 * np.eye(4)
    d = x[1] - x[0]
    expected = d @ np.linalg.solve(C.sum(axis=0), d)
    test = agreement_test(x, C)
    assert test.statistic == pytest.approx(expected, rel=1e-9)
    assert test.dof == 4
    assert test.p_value == pytest.approx(chi2.sf(expected, 4), rel=1e-9)


def test_several_runs_give_cochrans_q():
    """Of scalars the statistic is Cochran's Q with k - 1 degrees of freedom."""
    values, errors = np.array([1.0, 1.3, 0.8, 1.1]), np.array([0.1, 0.2, 0.15, 0.1])
    w = errors**-2
    expected = w @ (values - w @ values / w.sum()) ** 2
    test = agreement_test(values[:, None], (errors**2)[:, None, None])
    assert test.statistic == pytest.approx(expected, rel=1e-9)
    assert test.dof == 3


def test_directions_without_variance_do_not_count():
    """A singular covariance has as many degrees of freedom as its rank."""
    F = np.array([[1.0, 0.0], [0.0, 1.0], [1.0, 1.0]])
    C = np.array([F @ F.T, F @ F.T])
    test = agreement_test([np.zeros(3), F @ [1.0, 2.0]], C)
    assert test.dof == 2
    assert test.statistic == pytest.approx((1 + 4) / 2, rel=1e-6)


def test_p_values_of_equal_truths_are_uniform():
    """Estimates of one truth give uniform p-values: Kolmogorov-Smirnov p above 1e-3, which fails 1 seed in 1000."""
    rng = np.random.default_rng(2)
    mixing = rng.normal(size=(3, 6, 6)) * np.geomspace(1, 1e-3, 6)[:, None]
    C = mixing @ mixing.transpose(0, 2, 1)
    draws = np.einsum("kij,skj->ski", np.linalg.cholesky(C), rng.normal(size=(2000, 3, 6)))
    p_values = [agreement_test(x, C).p_value for x in draws]
    assert kstest(p_values, "uniform").pvalue > 1e-3


def test_holm_matches_the_published_procedure():
    """Ordered p-values are multiplied by m, m - 1, ... and never decrease (Holm 1979)."""
    assert adjust_holm([0.01, 0.04, 0.03, 0.005]) == pytest.approx([0.03, 0.06, 0.06, 0.02])
    assert adjust_holm([0.6, 0.9]) == pytest.approx([1.0, 1.0])

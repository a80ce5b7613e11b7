"""Quantiles and intervals against scipy's distributions and their definitions."""

import numpy as np
import pytest
from scipy.stats import beta, binom, chi2, norm, poisson, t

from estimation.uncertainty.quantiles import (
    CHI2_95,
    NORMAL_95,
    NORMAL_MEDIAN,
    band_of,
    chi2_limit,
    count_interval,
    median_interval,
    normal_limit,
    normal_quantile,
    robust_deviation,
    share_interval,
    student_95,
)


def test_constants_are_those_of_their_distributions():
    """The normal and chi-square quantiles, and Student's, which ends at the normal one."""
    assert norm.cdf(NORMAL_95) - norm.cdf(-NORMAL_95) == pytest.approx(0.95, abs=1e-12)
    assert chi2.sf(CHI2_95, 1) == pytest.approx(0.05, abs=1e-12)
    assert chi2.cdf(NORMAL_MEDIAN**2, 1) == pytest.approx(0.5, abs=1e-12)
    assert normal_quantile(0.8) == pytest.approx(norm.ppf(0.8))
    assert student_95(7) == pytest.approx(t.ppf(0.975, 7))
    assert student_95(10**7) == pytest.approx(NORMAL_95, rel=1e-6)


def test_limits_hold_the_false_alarm_rate_over_all_tests():
    """Seven tests at their common limit have alpha together, at most; two-sided normal tests are chi-square tests."""
    assert 7 * 2 * norm.sf(normal_limit(0.01, 7)) == pytest.approx(0.01)
    assert 7 * chi2.sf(chi2_limit(0.01, 3, 7), 3) == pytest.approx(0.01)
    assert normal_limit(0.01, 7) ** 2 == pytest.approx(chi2_limit(0.01, 1, 7))


def test_the_robust_deviation_is_that_of_normal_values_and_forgets_outliers():
    """Of 40,000 normal values within a hundredth, with 1 % outliers within two; NaN does not count."""
    values = np.random.default_rng(0).normal(scale=3.0, size=(40_000, 2))
    assert robust_deviation(values) == pytest.approx(np.full(2, 3.0), rel=0.02)
    values[:400], values[400:500] = 1e6, np.nan
    assert robust_deviation(values) == pytest.approx(np.full(2, 3.0), rel=0.03)


@pytest.mark.parametrize(("hits", "tries"), [(0, 9), (3, 9), (9, 9)])
def test_a_share_s_interval_is_where_its_tails_are(hits, tries):
    """At either end of the Clopper-Pearson interval, this count or one beyond has a probability of 2.5 %."""
    low, high = share_interval(hits, tries)
    assert low == 0.0 if hits == 0 else binom.sf(hits - 1, tries, low) == pytest.approx(0.025)
    assert high == 1.0 if hits == tries else binom.cdf(hits, tries, high) == pytest.approx(0.025)
    assert low == 0.0 if hits == 0 else low == pytest.approx(beta.ppf(0.025, hits, tries - hits + 1))


@pytest.mark.parametrize("count", [0, 1, 12])
def test_a_count_s_interval_is_where_its_tails_are(count):
    """At either end, this count or one beyond has a probability of 2.5 %."""
    low, high = count_interval(count)
    assert low == 0.0 if count == 0 else poisson.sf(count - 1, low) == pytest.approx(0.025)
    assert poisson.cdf(count, high) == pytest.approx(0.025)


def test_a_median_s_interval_leaves_out_what_chance_allows():
    """Below six values there is none; of n, the k-th smallest and largest, k as large as a tail of 2.5 % allows."""
    assert median_interval(()) is None
    assert median_interval(tuple(range(5))) is None
    for n in range(6, 60):
        low, high = median_interval(tuple(range(n)))
        assert low + high == n - 1
        assert binom.cdf(low, n, 0.5) <= 0.025 < binom.cdf(low + 1, n, 0.5)


def test_intervals_of_shares_are_the_published_ones():
    """1 of 150 gives 0.02 to 3.7 %, none of 300 at most 1.2 %."""
    assert share_interval(1, 150) == pytest.approx((0.00017, 0.0366), abs=5e-5)
    assert share_interval(0, 300) == pytest.approx((0.0, 0.01222), abs=5e-5)
    assert share_interval(300, 300)[1] == 1.0


def test_a_band_holds_its_share():
    """The half-width is the quantile of the errors that are known."""
    errors = np.abs(np.random.default_rng(0).normal(size=(20_000, 2)))
    np.testing.assert_allclose(band_of(errors), 1.96, rtol=0.03)
    errors[:, 1] = np.nan
    assert np.isnan(band_of(errors)[1])

"""Correlations over time are those of their definitions."""

import numpy as np
import pytest
from scipy.signal import lfilter

from estimation.uncertainty.correlations import (
    autocorrelation,
    correlation_rows,
    effective_rows,
    lagged_products,
    squared_differences,
)


def test_lagged_products_are_sums_over_pairs_of_rows():
    """Each column's sum of x(t) x(t + L), up to the last lag."""
    x = np.random.default_rng(0).normal(size=(60, 2))
    direct = np.array([(x[: 60 - lag] * x[lag:]).sum(axis=0) for lag in range(60)])
    np.testing.assert_allclose(lagged_products(x, 59), direct, atol=1e-12)
    np.testing.assert_allclose(lagged_products(x[:, 0], 7), direct[:8, 0], atol=1e-12)


@pytest.mark.parametrize("gaps", [False, True])
def test_autocorrelation_is_that_of_its_definition(gaps):
    """The correlations by FFT equal the sums over pairs, to rounding; pairs with a gap count for nothing."""
    rng = np.random.default_rng(0)
    y = np.convolve(rng.normal(size=300), np.ones(5), mode="valid")
    if gaps:
        y[40:60] = np.nan
    centred = y - np.nanmean(y)
    means = np.array([np.nanmean(centred[: len(y) - lag] * centred[lag:]) for lag in range(20)])
    sums = np.array([np.nansum(centred[: len(y) - lag] * centred[lag:]) for lag in range(20)])
    np.testing.assert_allclose(autocorrelation(y, 19, by_pairs=True), means / means[0], atol=1e-12)
    np.testing.assert_allclose(autocorrelation(y, 19), sums / sums[0], atol=1e-12)


@pytest.mark.parametrize("series", [np.zeros(9), np.full(9, np.nan)])
def test_a_constant_has_no_autocorrelation_and_every_row_counts(series):
    """A series without variance, or of nothing, has NaN everywhere, no memory, and as many rows as there are."""
    assert np.isnan(autocorrelation(series, 4)).all()
    assert correlation_rows(series) == 0
    assert effective_rows(series) == 9


def test_the_memory_of_an_autoregressive_process_is_found():
    """Of rho = 0.9 the correlation is below 1 / e after 10 rows, and N rows hold as much as N / 19 independent ones."""
    rng = np.random.default_rng(1)
    x = lfilter([1.0], [1.0, -0.9], rng.normal(size=200_000))
    # 0.9^9 = 0.387 and 0.9^10 = 0.349, with an error of some 0.006.
    assert correlation_rows(x) == 10
    # (1 + rho) / (1 - rho) = 19; the sum up to the first crossing of zero scatters by some 3 %.
    assert len(x) / effective_rows(x) == pytest.approx(19.0, rel=0.1)


def test_squared_differences_are_means_over_the_rows_that_both_have():
    """At every shift that leaves a row in common, of two series of different length, and of a series and itself."""
    rng = np.random.default_rng(2)
    a, b = rng.normal(size=(40, 2)), rng.normal(size=(25, 2))
    for other in (b, a):
        shifts = np.arange(1 - len(other), len(a))
        direct = []
        for shift in shifts:
            rows = np.arange(max(shift, 0), min(len(a), len(other) + shift))
            direct.append(((a[rows] - other[rows - shift]) ** 2).mean(axis=0))
        np.testing.assert_allclose(squared_differences(a, other, shifts), direct, atol=1e-12)

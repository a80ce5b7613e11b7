"""The Mittag-Leffler function against closed forms and its power series."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import erfcx, gamma, gammaln

from robots.common.errors import InputError
from robots.thermal import mittag_leffler


def series(x: float, order: float) -> float:
    """The power series; terms in doubles are good where they do not cancel, x <= 1."""
    k = np.arange(200)
    return float(np.sum((-1.0) ** k * np.exp(k * np.log(x) - gammaln(order * k + 1.0))))


def test_order_one_half_is_the_scaled_error_function() -> None:
    """E_1/2(-x) = exp(x^2) erfc(x), over twelve decades."""
    x = np.logspace(-6, 6, 61)
    np.testing.assert_allclose(mittag_leffler(x, 0.5), erfcx(x), rtol=1e-10)


@pytest.mark.parametrize("order", [0.1, 0.3, 0.6121, 0.9, 0.99, 0.9999])
def test_small_arguments_follow_the_series(order: float) -> None:
    """Up to x = 1 the function is its power series."""
    for x in (1e-3, 0.1, 0.7, 1.0):
        assert mittag_leffler(x, order) == pytest.approx(series(x, order), abs=1e-11)


@pytest.mark.parametrize("order", [0.3, 0.6121, 0.9])
def test_large_arguments_follow_the_power_law(order: float) -> None:
    """E_nu(-x) falls as 1 / (Gamma(1 - nu) x), up to the next term."""
    x = 1e6
    leading = 1.0 / (gamma(1.0 - order) * x)
    assert mittag_leffler(x, order) == pytest.approx(leading, rel=1e-4)


def test_order_one_is_the_exponential_and_nearby_orders_approach_it() -> None:
    """E_1(-x) = exp(-x)."""
    x = np.linspace(0.0, 5.0, 11)
    np.testing.assert_array_equal(mittag_leffler(x, 1.0), np.exp(-x))
    np.testing.assert_allclose(mittag_leffler(x, 1.0 - 1e-6), np.exp(-x), atol=1e-5)


def test_zero_is_one_and_bad_input_is_refused() -> None:
    """The function begins at one; negative arguments and orders out of range are refused."""
    assert mittag_leffler(0.0, 0.4) == pytest.approx(1.0, abs=1e-14)
    for x, order in ((-1.0, 0.5), (np.nan, 0.5), (1.0, 0.0), (1.0, 1.5)):
        with pytest.raises(InputError, match="Mittag-Leffler"):
            mittag_leffler(x, order)

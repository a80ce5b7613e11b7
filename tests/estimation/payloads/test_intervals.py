"""Intervals of mass, centre and inertia."""

from __future__ import annotations

import numpy as np
import pytest

from estimation.payloads.body import Body
from estimation.payloads.intervals import NORMAL_95, fieller, quantities

TRUTH = Body.of(1.0, [0.02, -0.03, 0.1], np.diag([0.003, 0.004, 0.002])).parameters
SPREAD = np.array([0.05, *[0.004] * 3, *[0.0008] * 6])


def test_fieller_of_a_certain_denominator_is_the_plain_interval() -> None:
    """Without an error of the mass the interval is that of the first moment over the mass."""
    assert fieller(0.2, 2.0, np.diag([1e-4, 0.0])) == pytest.approx((0.1 - 0.0098, 0.1 + 0.0098), abs=1e-5)


def test_fieller_of_a_mass_that_may_be_zero_is_the_whole_line() -> None:
    """A centre of nothing is anywhere."""
    assert fieller(0.2, 0.1, np.diag([1e-4, 0.1**2])) == (-np.inf, np.inf)


def test_the_ends_of_fiellers_interval_are_where_significance_ends() -> None:
    """At both ends a - r b is exactly 1.96 standard errors from zero."""
    covariance = np.array([[4e-4, 1e-4], [1e-4, 9e-4]])
    for ratio in fieller(0.3, 0.5, covariance):
        turn = np.array([1.0, -ratio])
        assert abs(0.3 - ratio * 0.5) == pytest.approx(NORMAL_95 * np.sqrt(turn @ covariance @ turn), rel=1e-9)


@pytest.mark.slow
def test_intervals_hold_the_truth_as_often_as_stated() -> None:
    """Of 300 draws 95 % hold mass, centre, and inertia; less than 91 % has a chance of 1 in 1000 each."""
    rng = np.random.default_rng(0)
    root = np.linalg.qr(rng.normal(size=(10, 10)))[0] * np.sqrt(np.linspace(0.3, 2.0, 10))
    covariance = (SPREAD[:, None] * root) @ (SPREAD[:, None] * root).T
    draws = rng.multivariate_normal(TRUTH, covariance, 300)
    true = quantities(TRUTH, covariance, TRUTH)
    held = np.array(
        [
            [
                item.lower <= t.value <= item.upper
                for item, t in zip(quantities(d, covariance, TRUTH), true, strict=True)
            ]
            for d in draws
        ]
    )
    shares = held.mean(axis=0)
    assert (shares[:4] > 0.91).all()
    # The true body is within its own interval by the extension to the consistent value, here the truth itself.
    assert (shares[4:] >= 0.91).all()


def test_an_interval_holds_the_value_and_no_negative_moment() -> None:
    """Least squares far from any body: intervals of moments begin at zero and reach the consistent value."""
    values = TRUTH.copy()
    values[4:] -= 0.02
    items = {item.name: item for item in quantities(values, np.diag(SPREAD**2), TRUTH)}
    for item in items.values():
        assert item.lower <= item.value <= item.upper
    assert items["Ixx"].lower == 0.0
    assert items["Ixx"].unconstrained < 0
    # Not narrower than an interval about zero.
    assert items["Ixx"].upper >= NORMAL_95 * SPREAD[4]

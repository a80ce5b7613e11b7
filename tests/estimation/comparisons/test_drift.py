"""Drift over runs: trend, and the run from which a quantity is settled."""

import numpy as np
import pytest

from estimation.comparisons import compare
from estimation.comparisons.drift import settled_from, weighted_slope


def test_slope_is_that_of_weighted_least_squares():
    """The slope and its error are those of the closed form for known errors."""
    x, errors = np.array([0.0, 1.0, 2.0, 4.0]), np.array([0.1, 0.2, 0.1, 0.3])
    X = np.column_stack([np.ones(4), x])
    values = 1.0 + 0.5 * x + np.array([0.01, -0.02, 0.0, 0.03])
    C = np.linalg.inv(X.T @ (X / errors[:, None] ** 2))
    expected = C @ X.T @ (values / errors**2)
    slope, error = weighted_slope(x, values, errors)
    assert slope == pytest.approx(expected[1])
    assert error == pytest.approx(np.sqrt(C[1, 1]))


def test_scatter_beyond_the_errors_widens_the_slope():
    """Runs that scatter ten times as much as their errors say have a slope error ten times as large (Birge)."""
    x, errors = np.arange(6.0), np.full(6, 0.1)
    off = np.array([1.0, -1.0, -1.0, -1.0, -1.0, 1.0])
    off -= off.mean()
    off -= (x - x.mean()) * (off @ (x - x.mean())) / ((x - x.mean()) @ (x - x.mean()))
    values = off * 1.0 * np.sqrt(4 / (off @ off))
    _, error = weighted_slope(x, values, errors)
    assert error == pytest.approx(10 * 0.1 / np.sqrt(np.sum((x - x.mean()) ** 2)))


def test_settling_is_found_where_the_course_is_flat():
    """An exponential of one run's time constant is within the noise of its end from the expected run on."""
    values = 1 + 0.7 * np.exp(-np.arange(12) / 2.0)
    errors = np.full(12, 0.01)
    settled, final = settled_from(values, errors, 0.01)
    assert final == pytest.approx(values[-4:].mean())
    assert settled is not None
    # z = 3.34 for 12 runs at 1 %, of sqrt(1 + 1/4) times 0.01: within 0.037 of the mean of the last four.
    assert values[settled] - final <= 0.0374 < values[settled - 1] - final


def test_a_course_that_never_settles_is_said():
    """A line that goes on through the last third is not settled."""
    assert settled_from(np.arange(9.0), np.full(9, 0.1), 0.01)[0] is None


def test_cold_to_warm_is_a_significant_trend(draw):
    """Friction that falls over eight runs has a significant trend and settles; inertial parameters have none."""
    factors = 0.6 + 0.4 * np.exp(-np.arange(8))
    found = compare([draw(seed, (factor,) * 3) for seed, factor in enumerate(factors)])
    moving = {item.name for item in found.drifts if item.adjusted < 0.05 or item.settled not in (0, None)}
    assert all(any(name.startswith(f"friction of joint {j}") for name in moving) for j in (1, 2, 3))
    inertial = {c.name for c in found.common.columns if not c.friction}
    assert not inertial & {item.name for item in found.drifts if item.adjusted < found.alpha}


def test_few_runs_have_no_course(draw):
    """Three runs show no drift."""
    assert compare([draw(1), draw(2), draw(3)]).drifts == ()

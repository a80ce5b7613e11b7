"""Steps are dated and sized with honest intervals, beside a correlated model error."""

import numpy as np
import pytest

from estimation.monitoring.control_charts.change_fit import fit_steps
from estimation.monitoring.control_charts.level_filter import CORRELATION_TIME, LevelFilter

COUNT, SCATTER, NOISE, STEP = 60, 0.03, 0.005, 0.2


def series(seed, step=STEP, place=40):
    """An unknown level, an Ornstein-Uhlenbeck error, noise and a step."""
    rng = np.random.default_rng(seed)
    t = 10.0 * np.arange(COUNT)
    e = np.empty(COUNT)
    e[0] = rng.normal()
    keep = np.exp(-10.0 / CORRELATION_TIME)
    for k in range(1, COUNT):
        e[k] = keep * e[k - 1] + np.sqrt(1 - keep**2) * rng.normal()
    return t, 0.05 * rng.normal() + SCATTER * e + NOISE * rng.normal(size=COUNT) + step * (np.arange(COUNT) >= place)


def fitted(seed, **options):
    t, y = series(seed, **options)
    return fit_steps(t, y, np.full(COUNT, NOISE**2), np.ones((COUNT, 1)), np.zeros(1), np.array([[0.05**2]]), SCATTER)


def test_date_and_size_of_a_step():
    """A step of 20 % is dated to its window; 95 % intervals of 200 sizes hold it in 90 to 99 % (binomial, 1e-3)."""
    fits = [fitted(seed) for seed in range(200)]
    assert all(abs(fit.best(1, COUNT - 1) - 40) <= 1 for fit in fits)
    assert all(fit.interval()[0] <= 40 <= fit.interval()[1] for fit in fits[:50])
    inside = [abs(fit.sizes[40] - STEP) < 1.96 * fit.errors[40] for fit in fits]
    assert 0.90 < np.mean(inside) < 0.99


def test_error_of_a_pause_is_no_step():
    """An error by unlogged work that lasts for one log of four is below the threshold of a step that comes to stay.

    Without its covariance the same error is a step of more than five standard errors.
    """
    t = np.concatenate([1500.0 * log + 10.0 * np.arange(6) for log in range(4)])
    log = np.repeat(np.arange(4), 6)
    y = 0.12 * (log == 2) + NOISE * np.random.default_rng(0).normal(size=24)
    spread = 0.08 * (log > 0)
    same = np.where(log[:, None] == log, 1.0, 0.5)
    fixed = (t, y, np.full(24, NOISE**2), np.ones((24, 1)), np.zeros(1), np.array([[0.05**2]]), 0.01)
    begin = np.array([12])
    plain = fit_steps(*fixed, begin)
    found = fit_steps(*fixed, begin, unlogged=same * spread[:, None] * spread)
    assert plain.gains[0] > 5.0**2
    assert found.gains[0] < 3.0**2


def test_no_step_gives_chi_square_gains():
    """Without a step the gain at a fixed window is chi-square: mean 1 within 0.4 (four standard errors of 200)."""
    assert np.mean([fitted(seed, step=0.0).gains[40] for seed in range(200)]) == pytest.approx(1.0, abs=0.4)


def test_filter_learns_level_and_scatter():
    """After 1000 windows the level is that of the data, and the learnt scatter theirs within 35 %."""
    found = LevelFilter(np.zeros(1), np.ones(1), 0.1)
    rng = np.random.default_rng(0)
    e, keep = 0.0, np.exp(-10.0 / CORRELATION_TIME)
    for k in range(1000):
        e = keep * e + SCATTER * np.sqrt(1 - keep**2) * rng.normal()
        found.predict(10.0 * k)
        found.update(np.ones(1), 0.7 + e + NOISE * rng.normal(), NOISE**2)
    # The mean of 10,000 s of an error with 300 s of memory has a standard error of 0.03 * sqrt(600 / 10000).
    assert found.coefficients[0] == pytest.approx(0.7, abs=4 * SCATTER * np.sqrt(600 / 10000))
    # The prior of 0.1 counts as 30 windows of some 900: sqrt(30 * 0.1^2 + 860 * 0.03^2) is 0.035.
    assert found.deviation == pytest.approx(SCATTER, rel=0.35)


def test_filter_survives_a_file():
    """A filter read from plain data goes on with the same numbers."""
    one = LevelFilter(np.zeros(2), np.ones(2), 0.1)
    one.predict(0.0)
    one.update(np.array([0.3, 1.0]), 0.5, 0.01)
    two = LevelFilter.from_dict(one.to_dict())
    for f in (one, two):
        f.predict(60.0)
        f.update(np.array([0.1, 1.0]), 0.4, 0.01)
    assert np.array_equal(one.state, two.state)
    assert np.array_equal(one.covariance, two.covariance)

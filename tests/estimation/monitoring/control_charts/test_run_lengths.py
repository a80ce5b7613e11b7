"""Thresholds give the stated time between false alarms, also for correlated values."""

import numpy as np
import pytest

from estimation.monitoring.control_charts.charts import (
    cusum_run_length,
    cusum_threshold,
    ewma_run_length,
    ewma_threshold,
)

CHAINS, STEPS = 1500, 3000


def values(rho, seed):
    """AR(1) sequences of unit variance, step by step (CHAINS,)."""
    rng = np.random.default_rng(seed)
    x = rng.normal(size=CHAINS)
    for _ in range(STEPS):
        yield x
        x = rho * x + np.sqrt(1 - rho**2) * rng.normal(size=CHAINS)


@pytest.mark.parametrize("rho", [0.0, 0.3])
def test_cusum_alarms_at_the_stated_rate(rho):
    """Simulated CUSUMs alarm once in 1000 steps within 15 %; with correlation they may be rarer, by six times at most.

    Siegmund's approximation itself has an error of some 10 %, and 4,500,000 steps leave 2 % of noise. The long-run
    variance overstates how far correlated values wander in the few steps of an alarm, so the threshold is too high.
    """
    threshold = cusum_threshold(1.0, 1000.0, rho)
    up, down, alarms = np.zeros(CHAINS), np.zeros(CHAINS), 0
    for x in values(rho, 1):
        up, down = np.maximum(0, up + x - 1.0), np.maximum(0, down - x - 1.0)
        hit = np.maximum(up, down) > threshold
        alarms += int(hit.sum())
        up[hit] = down[hit] = 0.0
    assert 0.85 < CHAINS * STEPS / alarms / 1000.0 < (1.15 if rho == 0.0 else 6.0)


@pytest.mark.parametrize("rho", [0.0, 0.9])
def test_ewma_crosses_at_the_stated_rate(rho):
    """Simulated EWMAs cross their threshold once in 1000 steps within 10 %: the rate is exact for normal values.

    Some 4,500 crossings, correlated in clusters, leave 3 % of noise; three standard deviations are 9 %.
    """
    weight = 0.1
    # Standard deviation of an EWMA of a standard normal AR(1) sequence in steady state.
    deviation = np.sqrt(weight / (2 - weight) * (1 + (1 - weight) * rho) / (1 - (1 - weight) * rho))
    threshold = ewma_threshold(weight, 1000.0, rho) * deviation
    level, before, crossings, seen = np.zeros(CHAINS), np.zeros(CHAINS, dtype=bool), 0, 0
    for step, x in enumerate(values(rho, 2)):
        level = level + weight * (x - level)
        above = np.abs(level) > threshold
        if step > 200:
            crossings += int((above & ~before).sum())
            seen += CHAINS
        before = above
    assert seen / crossings == pytest.approx(1000.0, rel=0.1)


def test_thresholds_and_run_lengths_are_inverse():
    """The threshold of a run length has this run length."""
    assert cusum_run_length(cusum_threshold(0.5, 12345.0, 0.2), 0.5, 0.2) == pytest.approx(12345.0)
    assert ewma_run_length(ewma_threshold(0.05, 12345.0, 0.9), 0.05, 0.9) == pytest.approx(12345.0)


def test_correlation_raises_the_threshold_of_a_cusum():
    """Correlated values wander, so the same rate needs a higher threshold."""
    assert cusum_threshold(1.0, 1e5, 0.4) > cusum_threshold(1.0, 1e5, 0.0) + 2

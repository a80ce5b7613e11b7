"""The observer's filter and the torque of a step, in closed form."""

from __future__ import annotations

import numpy as np
import pytest

from estimation.external_forces.residuals.filters import external_torque, filtered, restarts, time_constant


@pytest.mark.parametrize("jitter", [0.0, 0.3])
def test_step_response_is_an_exponential(jitter):
    """A step gives 1 - exp(-t / T), for even and uneven time."""
    steps = 0.004 * (1 + jitter * np.random.default_rng(0).uniform(-1, 1, 500))
    t = np.concatenate([[0.0], np.cumsum(steps)])
    begins = np.zeros(501, dtype=bool)
    begins[0] = True
    y = filtered(np.ones((501, 2)), t, 0.04, begins, from_zero=True)
    np.testing.assert_allclose(y[:, 0], 1 - np.exp(-t / 0.04), atol=1e-12)


def test_filter_begins_anew_after_a_gap():
    """After a gap longer than it remembers the filter knows nothing of before."""
    t = np.concatenate([0.01 * np.arange(50), 5 + 0.01 * np.arange(50)])
    begins = restarts(t, 0.04)
    assert np.flatnonzero(begins).tolist() == [0, 50]
    y = filtered(np.ones((100, 1)), t, 0.04, begins, from_zero=True)
    np.testing.assert_allclose(y[:50], y[50:], atol=1e-12)


def test_slow_log_is_no_gap():
    """Of a log whose period exceeds the time constant only the first sample begins."""
    assert restarts(0.1 * np.arange(10), 0.04).sum() == 1


def test_external_torque_is_what_momentum_does_not_explain():
    """A point mass m under a force F and a drive u: p = m v, and the rest is F."""
    t = np.cumsum(np.random.default_rng(1).uniform(0.002, 0.006, 300))
    u = 3 * t  # the trapezoidal rule is exact
    F, m = 2.0, 1.7
    p = F * t + 1.5 * t**2
    found = external_torque(t, m * p[:, None] / m, u[:, None], restarts(t, 0.04))
    np.testing.assert_allclose(found[1:, 0], F, atol=1e-9)
    assert found[0, 0] == 0.0


def test_bandwidth_is_that_of_a_first_order_filter():
    """At the bandwidth a first-order filter is 3 dB down."""
    assert 1 / np.hypot(1, 2 * np.pi * 4.0 * time_constant(4.0)) == pytest.approx(np.sqrt(0.5))

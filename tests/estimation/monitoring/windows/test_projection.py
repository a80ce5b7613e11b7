"""Projection of a window: joints that rest have no residual, and the scatter of a residual's RMS is known."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from estimation.monitoring.windows.projection import Colour, Directions, project


def window(noise, resting=(), colour=None):
    """Projects noise (N, n) of an arm whose friction changes sign every second; some joints rest throughout."""
    count, n = noise.shape
    t = 0.01 * np.arange(count)
    dq = np.sign(np.sin(np.pi * t))[:, None] * np.ones(n)
    dq[:, list(resting)] = 0.0
    friction = dq.copy()
    return project(
        t,
        dq,
        friction + noise,
        Directions(rest=np.zeros((count, n)), friction=friction, payload=np.zeros((count, n, 0))),
        colour=colour,
        expected=np.ones(n),
        usual_speed=np.ones(n),
        edges=(0.0, 0.01 * count),
    )


def test_a_joint_at_rest_has_no_residual():
    """The residual of a joint that rests is static friction, which no model contains."""
    noise = 0.05 * np.random.default_rng(1).normal(size=(1000, 3))
    found = window(noise, resting=[1])
    np.testing.assert_array_equal(found.moves, [True, False, True])
    assert found.residual_rms[[0, 2]] == pytest.approx([0.05, 0.05], rel=0.1)


@pytest.mark.slow
@pytest.mark.parametrize("memory", [0.0, 0.6, 0.9])
def test_scatter_of_the_residual_is_stated(memory):
    """Over 200 windows the log of the RMS scatters as stated.

    A standard deviation from 200 numbers is known to 5 %, so that it is beyond 25 % in 1 of 10,000 choices of the
    seeds. The autocovariances of strongly coloured noise end at the highest lag.
    """
    rng = np.random.default_rng(2)
    windows = [window(0.05 * lfilter([1.0], [1.0, -memory], rng.normal(size=(1000, 1)), axis=0)) for _ in range(200)]
    scatter = np.std([np.log(one.residual_rms[0]) for one in windows])
    stated = np.sqrt(np.median([one.residual_variance(0) for one in windows]))
    assert stated == pytest.approx(scatter, rel=0.25)


def test_a_joint_whose_noise_is_not_known_takes_that_of_the_window():
    """A joint that has rested so far has no noise of its own yet; it must not spoil the window of the others."""
    noise = 0.05 * np.random.default_rng(3).normal(size=(1000, 2))
    rested = window(noise, resting=[1])
    known = Colour.fit(rested.colour, rested.rows).of(rested.moves)
    found = window(noise, colour=known)
    assert np.isfinite(found.covariance).all()
    assert found.values[:2] == pytest.approx([1.0, 1.0], abs=0.02)

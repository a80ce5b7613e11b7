"""The noise of velocities, from smoothed positions and from logged velocities."""

from __future__ import annotations

import numpy as np
import pytest

from estimation.external_forces.residuals.velocity_noise import SLIDING, logged_noise, sliding_speed, smoothed_noise
from estimation.preprocessing import resample, smooth
from robots.signals import Log


@pytest.mark.parametrize("rate", [100.0, 500.0])
def test_noise_of_smoothed_velocities_follows_from_what_the_smoothing_removes(rate):
    """White noise on a slow motion: stated to 20 %, for the filter's edge is not sharp."""
    t = np.arange(round(60 * rate)) / rate
    true = np.column_stack([np.sin(t), 0.3 * np.cos(2 * t)])
    q = true + np.random.default_rng(1).normal(size=true.shape) * [1e-4, 2e-5]
    motion = smooth(resample(t, q), 20.0)
    inside = slice(100, -100)
    speed = np.column_stack([np.cos(t), -0.6 * np.sin(2 * t)])
    error = (motion.dq - speed)[inside].std(axis=0)
    assert smoothed_noise(Log(t=t, q=q), motion, 20.0) == pytest.approx(error, rel=0.2)


def test_noise_of_logged_velocities_is_found_beside_the_motion():
    """A motion of 1 Hz adds nothing; the deviation of the median of 10,000 numbers is 2 %."""
    t = 0.002 * np.arange(10_000)
    dq = np.sin(2 * np.pi * t)[:, None] + np.random.default_rng(2).normal(size=(len(t), 1)) * 0.003
    assert logged_noise(dq) == pytest.approx([0.003], rel=0.1)


def test_a_joint_slides_above_the_noise():
    """Three standard deviations of the noise, and no less than what static friction needs."""
    np.testing.assert_allclose(sliding_speed(np.array([1e-4, 0.02])), [SLIDING, 0.06])

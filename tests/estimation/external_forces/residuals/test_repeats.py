"""Which part of a motion is new."""

from __future__ import annotations

import numpy as np
import pytest

from estimation.external_forces.thresholds.healthy_logs import first_visits


def periodic(seconds, period, n=3, seed=0):
    """Two sines per joint; derivatives in closed form."""
    rng, t = np.random.default_rng(seed), 0.01 * np.arange(round(100 * seconds))
    w = 2 * np.pi / period * np.array([1.0, 2.0])
    size, phase = rng.normal(size=(2, 2, n))
    angle = t[:, None, None] * w[:, None] + phase
    return t, (size * np.sin(angle)).sum(axis=1), (size * w[:, None] * np.cos(angle)).sum(axis=1)


@pytest.mark.parametrize("period", [12.0, 20.0])
def test_periodic_motion_is_new_for_one_period(period):
    """Of 180 s of a motion of 20 s only 20 s are new; noise of the encoders does not matter."""
    t, q, dq = periodic(180.0, period)
    q = q + 1e-4 * np.random.default_rng(1).normal(size=q.shape)
    assert 0.01 * first_visits(t, q, dq).sum() == pytest.approx(period, rel=0.05)


def test_motion_that_does_not_repeat_is_new_throughout():
    """Six sinusoids per joint with frequencies of their own: less than a hundredth resembles an earlier moment."""
    rng, t = np.random.default_rng(2), 0.01 * np.arange(30_000)
    w, phase, size = rng.uniform(0.3, 3.0, (6, 6)), rng.uniform(0, 6, (6, 6)), rng.normal(size=(6, 6))
    angle = t[:, None, None] * w + phase
    found = first_visits(t, (size * np.sin(angle)).sum(axis=1), (size * w * np.cos(angle)).sum(axis=1))
    assert found.mean() > 0.99


def test_resting_robot_is_new_once_and_a_resting_joint_does_not_matter():
    """After a motion the robot rests for two minutes: that is one place. A joint that never moves is left out."""
    t, q, dq = periodic(30.0, 1000.0)
    rest = np.ones((12_000, 1))
    q, dq = np.concatenate([q, q[-1] * rest]), np.concatenate([dq, 0 * dq[-1] * rest])
    t = 0.01 * np.arange(len(q))
    q[:, 2], dq[:, 2] = 0.3, 0.0
    assert first_visits(t, q, dq)[3000 + 1000 :].sum() == 0
    assert first_visits(t, 0 * q, 0 * dq).all()

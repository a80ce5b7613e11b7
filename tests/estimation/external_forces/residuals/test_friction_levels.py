"""The level of friction, followed."""

from __future__ import annotations

import numpy as np
import pytest

from estimation.external_forces.residuals.friction_levels import (
    FRICTION_MEMORY,
    contact_weight,
    friction_excess,
    steady_clock,
)


def signals(seconds, excess):
    t = 0.01 * np.arange(round(100 * seconds))
    friction = 5 * np.sign(np.sin(2 * np.pi * 0.5 * t + 0.1))[:, None]
    return t, -excess(t)[:, None] * friction, friction, np.zeros(len(t), dtype=bool)


def test_constant_excess_is_found_from_the_first_sample():
    """Friction 20 % above the model's is known at once, from the first memory of the log."""
    found = friction_excess(*signals(60.0, lambda t: 0.2 + 0 * t))
    np.testing.assert_allclose(found, 0.2, atol=1e-9)


def test_drift_is_followed_with_the_lag_of_the_memory():
    """Of a ramp the excess is late by the time constant, as any first-order filter."""
    t, external, friction, begins = signals(300.0, lambda t: 1e-3 * t)
    found = friction_excess(t, external, friction, begins)
    assert found[-1, 0] == pytest.approx(1e-3 * (t[-1] - FRICTION_MEMORY), rel=0.01)


def test_short_push_hardly_counts():
    """A push of 0.2 s as large as the friction changes the level by its length over the memory."""
    t, external, friction, begins = signals(120.0, lambda t: 0 * t)
    push = (t > 60.0) & (t <= 60.2)
    external[push] -= friction[push]
    found = friction_excess(t, external, friction, begins)
    assert np.abs(found).max() == pytest.approx(0.2 / FRICTION_MEMORY, rel=0.05)


def test_strong_push_counts_as_one_at_the_threshold():
    """A push fifty times the threshold has a weight of a fiftieth; without a contact all samples count alike."""
    t, external, friction, begins = signals(120.0, lambda t: 0 * t)
    push = (t > 60.0) & (t <= 60.2)
    external[push] -= 50.0 * friction[push]
    weights = contact_weight(np.where(push, 50.0**2, 0.5))
    found = friction_excess(t, external, friction, begins, weights)
    assert np.abs(found).max() == pytest.approx(0.2 / FRICTION_MEMORY, rel=0.05)
    t, external, friction, begins = signals(60.0, lambda t: 0.2 + 0 * t)
    np.testing.assert_allclose(friction_excess(t, external, friction, begins, np.full(len(t), 0.3)), 0.2, atol=1e-9)


def test_joint_without_friction_has_no_excess():
    """No division by zero for a joint that rests or has no friction."""
    t, external, friction, begins = signals(10.0, lambda t: 0 * t)
    assert (friction_excess(t, external, 0 * friction, begins) == 0).all()


def test_pause_counts_as_two_steps():
    """One sample after a pause does not stand for the pause."""
    np.testing.assert_allclose(steady_clock(np.array([0.0, 1.0, 2.0, 50.0, 51.0])), [0, 1, 2, 4, 5])


def test_rests_do_not_change_the_level():
    """At rest the model's friction has the sign of the velocity's noise; the level stays that of the sliding before."""
    t, external, friction, begins = signals(600.0, lambda t: 0.2 + 0 * t)
    slides = (t % 60.0 < 20.0)[:, None]
    noise = np.random.default_rng(1).choice([-5.0, 5.0], (len(t), 1))
    # What does not act counts as an external torque.
    external, friction = np.where(slides, external, noise), np.where(slides, friction, noise)
    found = friction_excess(t, external, friction, begins, slides=slides)
    np.testing.assert_allclose(found, 0.2, atol=1e-9)
    assert friction_excess(t, external, friction, begins).min() < -0.5

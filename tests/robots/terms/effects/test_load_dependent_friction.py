"""Friction that grows with the load: a gear's two efficiencies, of what drives and of what is driven back."""

from __future__ import annotations

import numpy as np
import pytest

from robots.terms.effects import EFFECTS

LOADED = EFFECTS["load_dependent_friction"]
FAST = 0.05  # [rad/s] beyond which the sign is one


@pytest.mark.parametrize(("forward", "back"), [(0.9, 0.85), (0.7, 0.8), (0.95, 0.95)])
def test_a_gear_passes_power_by_two_efficiencies(seen, forward, back):
    """The motor gives load power over one efficiency; driven back, it takes load power times the other."""
    now, joint = seen(2, seed=2), 1
    load, speed = now.load[:, 0], now.dq[:, 0]
    fast = np.abs(speed) > FAST
    power = load * speed
    assert (power[fast] > 0).any()
    assert (power[fast] < 0).any()
    motor = np.where(power > 0, power / forward, power * back)
    lost = 1 / forward - 1
    column = LOADED.columns(now, joint, ((1 - back) / lost, 0.0))[:, joint - 1, 0]
    got = (load + lost * column) * speed
    assert got[fast] == pytest.approx(motor[fast], rel=1e-6, abs=1e-9 * np.abs(motor).max())


def test_a_gear_alike_both_ways_grows_with_the_size_of_the_load(seen):
    """By default both columns are the load's size times the sign and times the velocity."""
    now = seen(2, seed=2)
    X = LOADED.columns(now, 2, (1.0, 0.0))[:, 1]
    size = np.abs(now.load[:, 1])
    np.testing.assert_allclose(X, np.column_stack([size * now.sign[:, 1], size * now.dq[:, 1]]), atol=1e-12)
    assert LOADED.grid(now, 2) == ((1.0, 0.0),)

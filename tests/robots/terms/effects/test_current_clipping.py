"""A drive's current limit, and what a log and a rating say against it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from robots.terms.effects import EFFECTS

CLIPPING = EFFECTS["current_clipping"]


def test_a_level_below_the_logged_torque_is_not_searched(now):
    """A drive delivers no more than its limit: levels far below the largest logged torques are left out."""
    torque = now.whole[:, 1]
    noise = 0.02 * np.abs(torque).max() * np.random.default_rng(0).standard_normal(now.whole.shape)
    level = 0.7 * float(np.abs(torque).max())
    high = float(np.quantile(np.abs(torque), 0.97))
    clipped = replace(now, measured=np.clip(now.whole, -level, level) + noise)
    ((lower, upper),) = CLIPPING.bounds(clipped, 2)
    # A true limit is searched.
    assert lower < level <= upper
    assert any(tried <= 1.2 * level for (tried,) in CLIPPING.grid(clipped, 2))
    free = replace(now, measured=now.whole + noise)
    assert min(tried for (tried,) in CLIPPING.grid(free, 2)) >= CLIPPING.bounds(free, 2)[0][0] >= 0.8 * high


def test_a_level_far_below_the_rating_is_not_plausible(now):
    """No drive is limited to a twentieth of its joint's rated torque; without a rating any level may be."""
    rating = float(now.robot.limits.torque[1])
    assert np.isfinite(rating)
    one = np.array([1.0])
    assert CLIPPING.is_plausible(now.robot, 2, one, (0.3 * rating,))
    assert not CLIPPING.is_plausible(now.robot, 2, one, (0.01 * rating,))
    free = replace(now.robot, limits=replace(now.robot.limits, torque=np.full(now.robot.n, np.inf)))
    assert CLIPPING.is_plausible(free, 2, one, (0.01 * rating,))

"""Specification of rows at rest."""

import numpy as np

from estimation.preprocessing import rows_at_rest

STEP = 0.01


def test_stops_of_a_while_are_found():
    """A stop of half a second is found to the sample, one of a twentieth is not, and other joints do not matter."""
    t = STEP * np.arange(1000)
    speed = np.where((t > 3.0) & (t < 3.5) | (t > 6.0) & (t < 6.05), 0.0, 1.0)
    q = np.column_stack([np.cumsum(speed) * STEP, np.sin(3 * t)])
    found = rows_at_rest(t, q)
    stop = np.flatnonzero(found[:, 0])
    assert abs(stop[0] - 300) <= 1
    assert abs(stop[-1] - 349) <= 1
    assert len(stop) == stop[-1] - stop[0] + 1
    assert found[:, 1].mean() < 0.05


def test_encoder_steps_are_no_motion():
    """A joint that trembles by a count of its encoder stands."""
    rng = np.random.default_rng(0)
    t = STEP * np.arange(2000)
    q = np.where(t < 10.0, np.sin(2 * t), np.sin(20.0))[:, None]
    found = rows_at_rest(t, np.round((q + 2e-4 * rng.normal(size=q.shape)) / 5e-4) * 5e-4)
    assert found[t > 10.0].mean() > 0.95
    assert found[t < 10.0].mean() < 0.05


def test_a_joint_that_never_moves_has_none():
    """Of a joint that stands throughout nothing else is known; so of a log shorter than a stop."""
    t = STEP * np.arange(500)
    q = np.column_stack([np.full(500, 0.3), np.sin(t)])
    assert not rows_at_rest(t, q)[:, 0].any()
    assert not rows_at_rest(t[:5], q[:5]).any()
    assert not rows_at_rest(t[:1], q[:1]).any()

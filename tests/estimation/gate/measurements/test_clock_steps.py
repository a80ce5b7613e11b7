"""Specification of steps of the clock: found by the motion's continuity, and distinguished from missing rows."""

import numpy as np
import pytest

from estimation.recordings.rows.columns import Columns
from estimation.recordings.rows.timing import find_clock_steps
from robots.signals import Log

ROWS = 3000


def motion(t: np.ndarray, joints: int = 3, seed: int = 0, noise: float = 2e-5) -> np.ndarray:
    """Sums of sines up to 1.5 Hz, of about 1 rad/s, with encoder noise [rad]."""
    rng = np.random.default_rng(seed)
    w, phase = 2 * np.pi * rng.uniform(0.1, 1.5, (joints, 4)), rng.uniform(0, 2 * np.pi, (joints, 4))
    q = (np.sin(t[:, None, None] * w + phase) / w).sum(axis=2)
    return q + noise * rng.normal(size=q.shape)


def steps_of(t: np.ndarray, q: np.ndarray):
    return find_clock_steps(t, Columns.of(Log(t, q)))


@pytest.mark.parametrize("rate", [50, 100, 250, 1000])
@pytest.mark.parametrize("size", [0.02, 0.04, 0.05, 0.09])
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_a_clock_set_ahead_is_found(rate, size, seed):
    """Two steps of the clock, of 20 to 90 ms, are found in the row where they are.

    Longer ones are gaps, which are cut anyway. With three joints of about 1 rad/s and noise of 2e-5 rad, the arm moves
    enough in any place.
    """
    t = np.arange(ROWS) / rate
    q = motion(t, seed=seed)
    logged = t + size * (np.arange(ROWS) >= 1000) + size * (np.arange(ROWS) >= 2200)
    found = steps_of(logged, q)
    assert found.rows.tolist() == [1000, 2200]
    np.testing.assert_allclose(found.sizes, size, rtol=1e-6)


def test_a_clock_set_back_within_a_period_is_found():
    """At 20 Hz, a clock that is set back by 30 ms still runs forward."""
    t = np.arange(ROWS) / 20
    found = steps_of(t - 0.03 * (np.arange(ROWS) >= 700), motion(0.2 * t))
    assert found.rows.tolist() == [700]
    np.testing.assert_allclose(found.sizes, -0.03, rtol=1e-6)


@pytest.mark.parametrize("rate", [50, 100, 250, 1000])
@pytest.mark.parametrize("seed", range(5))
def test_missing_rows_are_no_step_of_the_clock(rate, seed):
    """Rows that are lost for 20 to 90 ms leave the times right."""
    t = np.arange(ROWS) / rate
    starts = np.arange(100, ROWS - 100, 150)
    lengths = np.maximum(1, (np.random.default_rng(seed).uniform(0.02, 0.09, len(starts)) * rate).astype(int))
    lost = np.concatenate([np.arange(a, a + b) for a, b in zip(starts, lengths, strict=True)])
    kept = np.delete(np.arange(ROWS), lost)
    assert not len(steps_of(t[kept], motion(t, seed=seed)[kept]).rows)


@pytest.mark.parametrize("honest", [True, False])
def test_uneven_times_are_no_steps_of_the_clock(honest):
    """Rows that are measured, or only written, up to 40 ms late do not set the clock."""
    rng = np.random.default_rng(0)
    t = np.arange(ROWS) / 100
    late = np.where(rng.random(ROWS) < 0.02, rng.uniform(0.0, 0.04, ROWS), 0.0)
    logged = np.maximum.accumulate(t + late) + 1e-6 * np.arange(ROWS)
    assert not len(steps_of(logged, motion(logged if honest else t)).rows)


def test_an_arm_at_rest_shows_no_step():
    """Without motion, a step of time may have been a pause."""
    t = np.arange(ROWS) / 100
    q = motion(np.where(t < 15, t, np.where(t < 20, 15.0, t - 5.0)))
    assert not len(steps_of(t + 0.08 * (t > 17), q).rows)

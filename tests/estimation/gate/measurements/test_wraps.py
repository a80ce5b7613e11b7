"""Specification of wrapped angles: any speed below half a turn a row, and no outlier that looks alike."""

import numpy as np
import pytest

from estimation.recordings.rows.wraps import find_wraps


def turning(speed: float, rate: float, rows: int = 1000, noise: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Turns to and fro, and on, at speeds up to `speed` [rad/s]."""
    t = np.arange(rows) / rate
    q = np.cumsum(speed / rate * (0.3 + 0.7 * np.sin(2 * np.pi * 0.13 * t))) + 0.4
    return t, q + noise * np.random.default_rng(0).normal(size=rows)


def wrapped(q: np.ndarray, turn: float = 2 * np.pi, low: float = -0.5) -> np.ndarray:
    return (q / turn - low) % 1.0 * turn + low * turn


@pytest.mark.parametrize(
    ("speed", "rate"), [(12.0, 50.0), (12.0, 500.0), (0.8, 20.0), (60.0, 50.0), (100.0, 50.0), (3.0, 1000.0)]
)
@pytest.mark.parametrize(("turn", "low"), [(2 * np.pi, -0.5), (2 * np.pi, 0.0), (360.0, -0.5)])
def test_wrapped_angles_are_unwrapped(speed, rate, turn, low):
    """Slow or fast, rare wraps or more than 1 % of the rows: the result differs from the truth by whole turns."""
    t, q = turning(speed, rate, rows=round(40 * rate))
    q = q * turn / (2 * np.pi)
    found = find_wraps(0, wrapped(q, turn, low), t)
    assert found is not None
    assert found.turn == turn
    apart = (found.q - q) / turn
    np.testing.assert_allclose(apart, round(float(apart[0])), atol=1e-9)


@pytest.mark.parametrize("step", [2 * np.pi / 512, 2 * np.pi / 4096])
def test_coarse_encoders_wrap(step):
    """Encoder steps and a joint that trembles at the border of the turn do not hide wraps."""
    t, q = turning(2.0, 100.0, noise=0.6 * step)
    q = np.round((q + np.pi - q.max() + 0.002) / step) * step
    found = find_wraps(0, wrapped(q), t)
    assert found is not None
    apart = (found.q - q) / (2 * np.pi)
    np.testing.assert_allclose(apart, round(float(apart[0])), atol=1e-9)


def test_rows_between_the_ends_of_a_turn_are_interpolated():
    """A logger that resamples by straight lines writes a row between pi and -pi."""
    t, q = turning(4.0, 200.0, rows=4000)
    at = t[:-1] + 0.4 * np.diff(t)
    found = find_wraps(0, np.interp(at, t, wrapped(q)), at)
    assert found is not None
    np.testing.assert_allclose(np.diff(found.q), np.diff(np.interp(at, t, q)), atol=2e-3)


def test_lost_rows_do_not_hide_wraps():
    """A missing row makes a longer step of the motion."""
    t, q = turning(12.0, 100.0)
    kept = np.delete(np.arange(len(t)), np.arange(7, len(t), 9))
    found = find_wraps(0, wrapped(q)[kept], t[kept])
    apart = (found.q - q[kept]) / (2 * np.pi)
    np.testing.assert_allclose(apart, round(float(apart[0])), atol=1e-9)


@pytest.mark.parametrize("size", [3.5, 5.0, 2 * np.pi, 7.0, 40.0, 1e6])
def test_outliers_are_no_wraps(size):
    """A single row that is off returns at once, even one that is off by a turn."""
    t, q = turning(2.0, 100.0)
    q[[200, 620]] += size
    assert find_wraps(0, q, t) is None


def test_a_reset_encoder_is_no_wrap():
    """A jump by another amount than a turn is left to be reported."""
    t, q = turning(2.0, 100.0)
    q[500:] -= 4.1
    assert find_wraps(0, q, t) is None

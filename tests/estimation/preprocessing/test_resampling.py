import numpy as np
import pytest

from estimation.preprocessing import resample, stale_rows
from robots.common.errors import InputError

PERIOD = 0.004


def even(samples=500, period=PERIOD):
    return period * np.arange(samples)


def wave(t):
    """Two joints on a motion that robots make: 1 Hz and 0.3 Hz."""
    return np.column_stack([np.sin(2 * np.pi * t), 0.7 * np.cos(2 * np.pi * 0.3 * t)])


def test_an_even_log_stays_as_it_is():
    """Where time is even and no row is stale, the grid holds the log's own numbers."""
    t = even()
    grid = resample(t, wave(t))
    assert grid.period == pytest.approx(PERIOD, rel=1e-12)
    assert grid.dropped == 0
    # Interpolating at the samples themselves: rounding of t alone.
    np.testing.assert_allclose(grid.q, wave(t), rtol=0, atol=1e-12)


def test_uneven_time_leaves_no_bias():
    """Samples at uneven times land on the grid without a systematic shift in time or amplitude."""
    rng = np.random.default_rng(0)
    t = np.cumsum(rng.uniform(0.4, 1.6, 5000) * 0.001)
    grid = resample(t, wave(t))
    error = grid.q - wave(grid.t)
    w = 2 * np.pi
    # Cubic pieces over h = 1.6 ms: the error is below h^2 / 8 w^2, that of straight lines.
    assert np.abs(error).max() < (0.0016 * w) ** 2 / 8
    # A shift in time would be an error along the velocity: it is below a microsecond.
    velocity = w * np.cos(w * grid.t)
    assert abs(error[:, 0] @ velocity / (velocity @ velocity)) < 1e-6


@pytest.mark.parametrize("lost", [0.0, 0.3])
def test_jitter_and_lost_rows_leave_no_noise(lost):
    """A fast joint, sampled with a jitter of a fifth of the period or without a third of its rows, is known to 50 urad.

    That is two steps of an encoder of 18 bits; slopes taken from neighbours only err fifty times as much.
    """
    rng = np.random.default_rng(2)
    t = 0.004 * np.arange(5000)
    t = np.sort(t + rng.normal(scale=0.0008, size=t.shape)) if not lost else t[rng.random(t.shape) > lost]
    grid = resample(t, _fast(t))
    inner = slice(20, -20)
    assert np.abs(grid.q[inner] - _fast(grid.t)[inner]).max() < 50e-6


def test_rows_that_crowd_make_no_slope_of_their_noise():
    """Messages that arrive at once, and a hole of a second: nothing overshoots."""
    rng = np.random.default_rng(3)
    t = 0.004 * np.arange(5000)
    t[100::50] = t[99::50][: len(t[100::50])] + 1e-7
    t = np.delete(t, slice(2000, 2250))
    noise = 1e-5 * rng.normal(size=(len(t), 1))
    grid = resample(t, _fast(t) + noise)
    within = t[np.searchsorted(t, grid.t).clip(1, len(t) - 1)] - grid.t < 0.1
    within &= grid.t - t[np.searchsorted(t, grid.t).clip(1, len(t) - 1) - 1] < 0.1
    error = np.abs(grid.q - _fast(grid.t))[20:-20, 0]
    assert error[within[20:-20]].max() < 1e-4
    assert grid.q.max() < _fast(t).max() + 1e-4


def _fast(t):
    return (0.5 * np.sin(2 * np.pi * t) + 0.1 * np.sin(2 * np.pi * 3.3 * t))[:, None]


def test_positions_outside_the_log_are_not_invented():
    """The grid begins with the log and ends within one period of its end."""
    t = np.cumsum(np.random.default_rng(1).uniform(0.5, 1.5, 300) * PERIOD)
    grid = resample(t, wave(t))
    assert grid.t[0] == t[0]
    assert t[-1] - grid.period - 1e-9 <= grid.t[-1] <= t[-1] + 1e-9


def test_a_late_start_of_the_clock_changes_nothing():
    """Time since 1970 gives the positions of time since zero."""
    t = even()
    late = resample(t + 1.7e9, wave(t))
    # Times of 1.7e9 s are rounded to 0.24 microseconds: 1.5e-6 rad at 6.3 rad/s.
    np.testing.assert_allclose(late.q, resample(t, wave(t)).q, rtol=0, atol=5e-6)


def test_repeated_messages_are_left_out():
    """Rows that repeat an old position while the arm moves are dropped, and the motion is whole again."""
    t = even()
    q = wave(t)
    late = np.arange(20, 480, 23)
    repeated = q.copy()
    repeated[late] = repeated[late - 1]
    stale = stale_rows(t, repeated)
    # Near the turning points a repeat differs from the motion by less than the threshold, and does no harm.
    assert set(np.flatnonzero(stale)) <= set(late)
    assert stale.sum() >= 0.9 * len(late)
    grid = resample(t, repeated)
    assert grid.dropped == stale.sum()
    before, after = np.abs(repeated - q).max(), np.abs(grid.q - q).max()
    assert after < 0.05 * before


def test_rest_is_not_stale():
    """An arm that stands, or crawls below the encoder's step, repeats its position rightly."""
    t = even()
    q = wave(t)
    q[200:300] = q[200]
    assert not stale_rows(t, q)[200:301].any()
    step = 1e-3
    slow = np.round(np.column_stack([0.02 * t, -0.01 * t]) / step) * step
    assert not stale_rows(t, slow).any()


def test_a_turning_point_is_not_stale():
    """Two equal rows about the turning point of a joint are the motion, not a repeated message."""
    phase = np.pi * (np.arange(200) + 0.5) / 50
    q = np.cos(phase)
    q[49::100] = q[50::100]  # equal to the last bit, as ideal positions are
    assert (np.diff(q) == 0).any()
    assert not stale_rows(even(200), q[:, None]).any()


def test_encoder_steps_are_kept():
    """Quantised positions of an even log pass unchanged: smoothing them is the filter's task."""
    t = even()
    step = 2 * np.pi / 4096
    q = np.round(wave(t) / step) * step
    np.testing.assert_allclose(resample(t, q).q, q, rtol=0, atol=1e-9)


def test_too_short_a_log_is_refused():
    """Fewer than 20 rows are an error that says so."""
    t = even(19)
    with pytest.raises(InputError, match="19 rows; allowed: 20 or more"):
        resample(t, wave(t))


def test_steps_of_denormal_size_are_no_error():
    """A position that changes by less than any encoder's step, at uneven times, is interpolated like any other."""
    rng = np.random.default_rng(0)
    t = np.cumsum(rng.uniform(0.005, 0.015, 200))
    q = np.column_stack([np.sin(t), np.cumsum(rng.choice([1e-312, 3e-312], 200))])
    grid = resample(t, q)
    assert np.isfinite(grid.q).all()
    np.testing.assert_allclose(grid.q[:, 1], 0.0, atol=1e-300)

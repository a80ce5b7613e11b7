import numpy as np
import pytest

from estimation.preprocessing import resample, smooth
from estimation.preprocessing.smoothing import BUTTERWORTH_ORDER, transient

PERIOD = 0.004
T = PERIOD * np.arange(5000)  # 20 s


def motion_of(signal, cutoff, t=T):
    return smooth(resample(t, signal[:, None]), cutoff)


def component(t, signal, frequency):
    """Amplitude and phase of a frequency, by projection on whole periods away from the ends."""
    inside = slice(1250, 3750)  # 10 s: whole periods of every frequency used here
    wave = np.exp(-2j * np.pi * frequency * t[inside])
    value = 2 * np.mean(signal[inside] * wave)
    return abs(value), np.angle(value)


def low_pass_gain(frequency, cutoff):
    """Butterworth's gain, squared by the second pass; bilinear frequencies."""
    own = cutoff / (np.sqrt(2) - 1) ** (1 / (2 * BUTTERWORTH_ORDER))
    ratio = np.tan(np.pi * frequency * PERIOD) / np.tan(np.pi * own * PERIOD)
    return 1 / (1 + ratio ** (2 * BUTTERWORTH_ORDER))


@pytest.mark.parametrize("frequency", [0.5, 2.0, 5.0, 8.0])
def test_a_sinusoid_keeps_its_phase_and_loses_the_closed_form(frequency):
    """Position, velocity and acceleration of a sinusoid have no phase lag and the filter's closed-form amplitude."""
    cutoff, x = 5.0, 2 * np.pi * frequency * PERIOD
    motion = motion_of(np.cos(2 * np.pi * frequency * T), cutoff)
    gain = low_pass_gain(frequency, cutoff)
    first = (45 * np.sin(x) - 9 * np.sin(2 * x) + np.sin(3 * x)) / (30 * PERIOD)  # sixth-order central differences
    second = (245 - 270 * np.cos(x) + 27 * np.cos(2 * x) - 2 * np.cos(3 * x)) / (90 * PERIOD**2)
    expected = ((motion.q, gain, 0.0), (motion.dq, gain * first, np.pi / 2), (motion.ddq, gain * second, np.pi))
    for signal, amplitude, phase in expected:
        found, angle = component(motion.t, signal[:, 0], frequency)
        # The ends' transients have died down to below a part in 10^6 within 5 s.
        assert found == pytest.approx(amplitude, rel=1e-6)
        assert abs((angle - phase + np.pi) % (2 * np.pi) - np.pi) < 1e-6


def test_the_cutoff_is_where_both_passes_lose_3_db():
    """At the cut-off the amplitude falls by the square root of two."""
    found, _ = component(T, motion_of(np.cos(2 * np.pi * 5 * T), 5.0).q[:, 0], 5.0)
    # The bilinear transform moves the cut-off by some parts in a thousand at 1/50 of the sampling rate.
    assert found == pytest.approx(1 / np.sqrt(2), rel=0.01)


def test_the_derivatives_are_those_of_the_motion():
    """Well below the cut-off, velocity and acceleration equal the analytic ones."""
    w = 2 * np.pi * 0.4
    motion = motion_of(np.sin(w * T), 20.0)
    inside = (T > 1) & (T < 19)
    # The filter's own loss (0.4/20)^6 and the differences' (w h)^6 / 140 are below 1e-9; rounding over h^2 is 1e-10.
    np.testing.assert_allclose(motion.dq[inside, 0], w * np.cos(w * T[inside]), atol=1e-7 * w)
    np.testing.assert_allclose(motion.ddq[inside, 0], -(w**2) * np.sin(w * T[inside]), atol=1e-6 * w**2)


def test_the_ends_are_trusted_after_the_transient():
    """Past the time that `transient` states, the error of a motion that starts in full speed is small."""
    w, cutoff = 2 * np.pi * 0.3, 5.0
    motion = motion_of(np.sin(w * T + 0.4), cutoff)
    edge = transient(motion.duration, cutoff)
    inside = (edge <= T) & (edge <= T[-1] - T)
    error = np.abs(motion.ddq[:, 0] + w**2 * np.sin(w * T + 0.4)) / w**2
    # Measured 4.4 % at the very edge: the mirrored extension has a kink in its curvature.
    assert error[inside].max() < 0.05
    assert error[(T > 1) & (T < 19)].max() < 1e-3


def test_a_line_and_a_rest_are_kept():
    """A constant speed and a standing arm are smoothed to themselves, up to the very ends."""
    motion = motion_of(0.3 + 0.7 * T, 5.0)
    np.testing.assert_allclose(motion.dq, 0.7, atol=1e-6)
    np.testing.assert_allclose(motion.ddq, 0.0, atol=1e-4)
    assert np.abs(motion_of(np.full_like(T, 1.2), 5.0).dq).max() < 1e-9


def test_quantised_positions_give_a_smooth_velocity():
    """Encoder steps of 1e-4 rad at 4 ms, 0.014 rad/s by differences, are smoothed to a tenth of that."""
    w, step = 2 * np.pi * 0.4, 1e-4
    motion = motion_of(np.round(np.sin(w * T) / step) * step, 5.0)
    inside = (T > 1) & (T < 19)
    error = motion.dq[inside, 0] - w * np.cos(w * T[inside])
    raw = step / np.sqrt(12) * np.sqrt(2) / PERIOD
    assert error.std() < 0.1 * raw
    assert abs(error.mean()) < 1e-4


def test_the_motion_is_at_the_times_of_the_log():
    """A log of uneven time gets its motion at its own times, without lag."""
    t = np.cumsum(np.random.default_rng(0).uniform(0.5, 1.5, 10_000) * 0.002)
    w = 2 * np.pi * 0.4
    motion = smooth(resample(t, np.sin(w * t)[:, None]), 10.0)
    assert np.array_equal(motion.t, t)
    inside = (t > 1) & (t < t[-1] - 1)
    # Interpolation between uneven samples costs parts in 10^5.
    np.testing.assert_allclose(motion.dq[inside, 0], w * np.cos(w * t[inside]), atol=1e-4 * w)
    np.testing.assert_allclose(motion.ddq[inside, 0], -(w**2) * np.sin(w * t[inside]), atol=5e-3 * w**2)


def test_a_cutoff_beyond_the_sampling_leaves_positions_alone():
    """A filter above half the sampling rate is none."""
    signal = np.random.default_rng(0).normal(size=len(T))
    assert np.array_equal(motion_of(signal, 200.0).q[:, 0], resample(T, signal[:, None]).q[:, 0])

import numpy as np
import pytest

from estimation.preprocessing import LowPass, SmoothingSpline, resample, smooth


def uneven(seconds=8.0, seed=0):
    """Steps of 0.4 to 1.6 ms, as a busy computer takes them."""
    return np.cumsum(np.random.default_rng(seed).uniform(0.4, 1.6, int(1000 * seconds)) * 1e-3)


def test_its_gain_is_that_of_the_low_pass():
    """Away from the ends, a sinusoid at the cut-off comes out 3 dB down and without a lag, as of the filter."""
    t = 0.001 * np.arange(10_000)
    for frequency in (1.0, 5.0, 8.0):
        q = np.sin(2 * np.pi * frequency * t)[:, None]
        positions = resample(t, q)
        spline, filtered = (smooth(positions, by(5.0)).q[3000:7000] for by in (SmoothingSpline, LowPass))
        gain = float((spline[:, 0] @ q[3000:7000, 0]) / (q[3000:7000, 0] @ q[3000:7000, 0]))
        expected = float((filtered[:, 0] @ q[3000:7000, 0]) / (q[3000:7000, 0] @ q[3000:7000, 0]))
        # Differences of coefficients stand for derivatives: exactly at one frequency, to some per cent beside it.
        assert gain == pytest.approx(expected, abs=0.03)
        quadrature = np.cos(2 * np.pi * frequency * t[3000:7000])
        assert abs(spline[:, 0] @ quadrature) / 2000 < 1e-3


def test_uneven_time_costs_nothing():
    """Samples count where they are: a slow motion at uneven times comes back to a part in a million."""
    t = uneven()
    w = 2 * np.pi * 0.5
    motion = smooth(resample(t, np.sin(w * t)[:, None]), SmoothingSpline(8.0))
    # Passed with a gain of 1 - (0.5/8)^6 and knots at 1/64 s, and no jerk at the very ends: below a part in 10^6.
    inside = slice(500, -500)
    assert np.abs(motion.q[:, 0] - np.sin(w * t))[inside].max() < 2e-6
    assert np.abs(motion.ddq[:, 0] + w**2 * np.sin(w * t))[inside].max() < 1e-5 * w**2


def test_the_ends_are_better_than_a_mirrors():
    """At the ends, where a filter has only a mirror image, the spline's acceleration is ten times better."""
    t = uneven()
    q = np.cos(2 * np.pi * t)[:, None]
    expected = -((2 * np.pi) ** 2) * np.cos(2 * np.pi * t)
    errors = [
        np.abs(smooth(resample(t, q), by(8.0)).ddq[:50, 0] - expected[:50]).max() for by in (SmoothingSpline, LowPass)
    ]
    assert errors[0] < 0.1 * errors[1]


def test_it_is_the_best_linear_estimate_of_its_own_process():
    """On a triple integral of white noise, no other cut-off than the process's own has a smaller error."""
    rng = np.random.default_rng(1)
    period, cutoff, samples = 0.005, 4.0, 3000
    t = period * np.arange(samples)
    own = cutoff / (np.sqrt(2) - 1) ** (1 / 6)
    noise = 1e-3
    # The process whose spectrum crosses the noise's at own: jerk of density noise^2 period (2 pi own)^6.
    density = noise**2 * period * (2 * np.pi * own) ** 6
    q = np.cumsum(np.cumsum(np.cumsum(rng.normal(size=samples) * np.sqrt(density / period)) * period) * period) * period
    measured = (q + noise * rng.normal(size=samples))[:, None]
    errors = [
        (smooth(resample(t, measured), SmoothingSpline(factor * cutoff)).q[200:-200, 0] - q[200:-200]).std()
        for factor in (0.5, 1.0, 2.0)
    ]
    assert errors[1] < errors[0]
    assert errors[1] < errors[2]
    assert errors[1] < 0.5 * noise


def test_a_late_clock_changes_nothing():
    """Time since 1970 gives what time since zero gives, to the rounding of the time stamps."""
    t = 0.004 * np.arange(1000)
    q = np.sin(t)[:, None]
    late, early = (smooth(resample(t + start, q), SmoothingSpline(5.0)) for start in (1.7e9, 0.0))
    np.testing.assert_allclose(late.dq, early.dq, atol=1e-4)

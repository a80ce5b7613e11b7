import numpy as np
import pytest

from estimation.preprocessing import Harmonics, LowPass, resample, smooth

PERIOD = 2.0


def motion(t):
    w = 2 * np.pi / PERIOD
    q = np.column_stack([np.sin(w * t) + 0.3 * np.cos(5 * w * t), 0.7 * np.cos(2 * w * t) - 0.2])
    ddq = np.column_stack([-(w**2) * np.sin(w * t) - 7.5 * w**2 * np.cos(5 * w * t), -2.8 * w**2 * np.cos(2 * w * t)])
    return q, ddq


@pytest.fixture
def log():
    """Four periods and a bit at uneven times, with an encoder's noise."""
    rng = np.random.default_rng(0)
    t = np.cumsum(rng.uniform(0.5, 1.5, 2100) * 0.004)
    q, ddq = motion(t)
    return t, q + 1e-4 * rng.normal(size=q.shape), ddq


def test_projection_is_exact_on_its_harmonics(log):
    """Without noise, position and acceleration of a periodic motion come back to rounding, up to the very ends."""
    t, _, ddq = log
    smoothed = smooth(resample(t, motion(t)[0]), Harmonics(PERIOD, 8))
    np.testing.assert_allclose(smoothed.q, motion(t)[0], atol=1e-12)
    np.testing.assert_allclose(smoothed.ddq, ddq, atol=1e-9)


def test_noise_falls_with_the_share_of_the_spectrum(log):
    """Accelerations are several times less noisy than a low-pass of the same cut-off makes them."""
    t, q, ddq = log
    inside = slice(100, -100)
    by = (Harmonics(PERIOD, 10), LowPass(5.0))
    errors = [(smooth(resample(t, q), one).ddq - ddq)[inside].std() for one in by]
    # 21 of some 2100 / 8 numbers that a 5 Hz low-pass keeps, plus what the low-pass takes of the fifth harmonic.
    assert errors[0] < 0.3 * errors[1]


def test_it_says_what_it_is():
    """The cut-off is the highest harmonic's frequency, and plain data hold period and order."""
    smoother = Harmonics(PERIOD, 10)
    assert smoother.cutoff == 5.0
    assert smoother.to_dict() == {"kind": "harmonics", "cutoff_hz": 5.0, "period_s": 2.0, "harmonics": 10}
    assert "10 harmonics" in smoother.text

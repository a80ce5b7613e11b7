"""What a controller's log makes of the truth."""

from __future__ import annotations

import numpy as np
import pytest

from robots.common.errors import InputError
from robots.plants import Sensors

PERIOD, SAMPLES, JOINTS = 0.004, 50_000, 6
TAU = np.tile([10.0, -3.0, 2.0, 1.0, 0.5, 0.1], (SAMPLES, 1))  # constant, so that all variation is noise


def noise(seed=1, **settings):
    sensors = Sensors(**settings)
    return sensors.torque(TAU, PERIOD, np.random.default_rng(seed)) - TAU


def autocorrelation(x, lag):
    return np.mean(x[lag:] * x[:-lag], axis=0) / np.mean(x**2, axis=0)


def test_the_noise_has_its_stated_size():
    """The noise's standard deviation is the stated share of each joint's torque RMS."""
    share = noise(torque_noise=0.02).std(axis=0) / np.abs(TAU[0])
    # Half of the variance is correlated over 0.04 s, ten samples: the estimate of six joints' deviation scatters by
    # less than 1 percent, so 4.5 percent is passed by chance once in 10^5 seeds.
    np.testing.assert_allclose(share, 0.02, rtol=0.045)


@pytest.mark.parametrize(("share", "time"), [(0.5, 0.04), (0.8, 0.02), (1.0, 0.1)])
def test_the_noise_has_its_stated_colour(share, time):
    """The autocorrelation falls from the coloured share by e within each correlation time; the white rest at once."""
    errors = noise(torque_noise=0.1, coloured_share=share, correlation_time=time)
    for lag in (1, 5, 25):
        expected = share * np.exp(-lag * PERIOD / time)
        # A correlation of 50,000 samples, of which up to 50 hang together, scatters by less than sqrt(50 / 50,000) =
        # 0.03, the mean of six joints by 0.013: 0.06 is passed by chance once in 10^5 seeds.
        assert autocorrelation(errors, lag).mean() == pytest.approx(expected, abs=0.06)


def test_white_noise_has_no_memory():
    """With no coloured share, or no correlation time, the noise is white."""
    for settings in ({"coloured_share": 0.0}, {"correlation_time": 0.0}):
        correlation = autocorrelation(noise(torque_noise=0.1, **settings), 1)
        # 1 / sqrt(50,000) = 0.0045; six times 4.5 standard deviations are passed by chance once in 10^4 seeds
        np.testing.assert_allclose(correlation, 0.0, atol=0.02)


def test_coloured_noise_is_stationary():
    """Coloured noise has its full size from the first sample on."""
    sensors = Sensors(torque_noise=1.0, coloured_share=1.0, correlation_time=10.0)
    tau = np.ones((2, 20_000))
    first = sensors.torque(tau, PERIOD, np.random.default_rng(0))[0] - 1.0
    # The deviation of 20,000 numbers scatters by 1 / sqrt(40,000) = 0.005; 0.025 is five times that.
    assert first.std() == pytest.approx(1.0, abs=0.025)


def test_joints_have_noise_of_their_own():
    """The noises of two joints are not correlated."""
    correlation = np.corrcoef(noise(torque_noise=0.1).T)
    # ten samples hang together: sqrt(10 / 50,000) = 0.014, of 15 pairs none beyond 5 standard deviations
    assert np.abs(correlation - np.eye(JOINTS)).max() < 0.07


def test_ideal_sensors_change_nothing():
    """Without noise, encoder and torque steps, the log is the truth."""
    ideal = Sensors(encoder_counts=0, torque_noise=0, torque_step=0)
    rng = np.random.default_rng(0)
    np.testing.assert_array_equal(ideal.torque(TAU, PERIOD, rng), TAU)
    np.testing.assert_array_equal(ideal.position(TAU, np.ones(JOINTS)), TAU)


def test_positions_are_whole_encoder_steps():
    """Positions are the nearest whole encoder steps, of 2 pi over counts and gear ratio, whatever the ratio's sign."""
    gear, q = np.array([100.0, -50.0]), np.random.default_rng(0).uniform(-3, 3, (500, 2))
    logged = Sensors(encoder_counts=4096).position(q, gear)
    step = 2 * np.pi / (4096 * np.abs(gear))
    counts = logged / step
    np.testing.assert_allclose(counts, np.round(counts), atol=1e-8)  # 2e5 counts with 16 digits
    assert (np.abs(logged - q) <= step / 2 * (1 + 1e-9)).all()
    assert (np.abs(logged - q) > step / 4).any()


def test_torques_are_whole_steps():
    """With a torque step, torques are the nearest multiples of it."""
    logged = Sensors(torque_noise=0.1, torque_step=0.25).torque(TAU, PERIOD, np.random.default_rng(0))
    np.testing.assert_array_equal(logged * 4, np.round(logged * 4))
    assert len(np.unique(logged[:, 0])) > 3


@pytest.mark.parametrize(
    "settings",
    [{"torque_noise": -1.0}, {"encoder_counts": -1.0}, {"correlation_time": np.nan}, {"torque_step": np.inf}],
)
def test_impossible_sensors_are_refused(settings):
    """A negative or infinite setting is refused by name."""
    with pytest.raises(InputError, match=f"sensors: {next(iter(settings))} is .*; allowed: zero or a positive number"):
        Sensors(**settings)


@pytest.mark.parametrize("share", [-0.1, 1.1, np.nan])
def test_an_impossible_share_is_refused(share):
    """The coloured share is between 0 and 1."""
    with pytest.raises(InputError, match=r"coloured_share is .*; allowed: 0 to 1"):
        Sensors(coloured_share=share)

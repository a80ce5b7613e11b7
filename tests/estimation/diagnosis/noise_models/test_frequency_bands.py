"""Tests of the usable frequency band: its filter, and the frequency at which acceleration errors bias the fit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import fftconvolve, firwin

from estimation.diagnosis.calibration import MAX_BIAS_CHI2
from estimation.diagnosis.noise_models.frequency_bands import Band, unbiased_frequencies
from estimation.diagnosis.noise_models.noise_estimate import estimate_whitening, quiet_joints
from estimation.diagnosis.recordings.recording import Recording, cut_recording
from tests.estimation.diagnosis.noisy_logs import STEP, noise_of, recording_of

ROWS = 250_000
COUNT, NOISE = 2 * np.pi / 2**14, 0.3


@pytest.fixture(scope="module")
def counted() -> tuple[Recording, np.ndarray, np.ndarray]:
    """Returns a joint of 1 kg m2 with a coarse encoder and random motion up to 2 Hz, true acceleration, and noise."""
    rng = np.random.default_rng(3)
    slow = np.fft.rfftfreq(ROWS, STEP) < 2.0
    q = 0.3 * np.fft.irfft(slow * np.fft.rfft(rng.standard_normal(ROWS)), ROWS)
    noisy = q + COUNT / np.sqrt(12) * rng.standard_normal(ROWS)
    accelerations = [_second_derivative(x) for x in (q, noisy)]
    zero = np.zeros((ROWS, 1))
    recording = Recording(
        t=STEP * np.arange(ROWS),
        starts=(0,),
        q=q[:, None],
        dq=zero,
        ddq=accelerations[1][:, None],
        tau=zero,
        step=STEP,
        cycles=(None,),
        cutoff=100.0,
        floor=np.array([COUNT**2 / 12 * 2 * STEP]),
        sign_unknown=np.zeros((ROWS, 1), dtype=bool),
        sign_known_from_velocity=np.zeros((ROWS, 1), dtype=bool),
        reversal_acceleration_error=np.zeros(1),
        names=("log",),
    )
    return recording, accelerations[0], NOISE * rng.standard_normal((ROWS, 1))


def _second_derivative(x: np.ndarray) -> np.ndarray:
    f = np.fft.rfftfreq(len(x), STEP)
    return np.fft.irfft(-((2 * np.pi * f) ** 2) * np.fft.rfft(x), len(x))


def _left(recording: Recording, true: np.ndarray, frequency: float) -> float:
    """Computes the torque energy that a fit of the inertia leaves below a frequency, in units of the noise variance."""
    taps = firwin(2001, frequency, fs=1 / STEP)
    measured, torque = (fftconvolve(x, taps, mode="valid") for x in (recording.ddq[:, 0], true))
    inertia = float(measured @ torque / (measured @ measured))
    return float(np.sum(((1 - inertia) * torque) ** 2)) / NOISE**2


def test_inertia_is_fitted_without_a_bias_that_shows(counted: tuple[Recording, np.ndarray, np.ndarray]) -> None:
    """Up to the found frequency the bias is the allowed one; up to twice the frequency it is far larger.

    Frequencies are an eighth of a hertz apart, and the bias grows with their tenth power, so a factor of two is
    allowed.
    """
    recording, true, noise = counted
    (frequency,) = unbiased_frequencies(recording, np.eye(1), noise)
    assert 5.0 < frequency < 60.0
    assert 0.4 * MAX_BIAS_CHI2 < _left(recording, true, frequency) < 2.5 * MAX_BIAS_CHI2
    assert _left(recording, true, 2 * frequency) > 100 * MAX_BIAS_CHI2


def test_a_larger_inertia_is_known_further(counted: tuple[Recording, np.ndarray, np.ndarray]) -> None:
    """A larger inertia gives a lower frequency, because the bias grows with its square."""
    recording, _, noise = counted
    assert unbiased_frequencies(recording, 3 * np.eye(1), noise) < unbiased_frequencies(recording, np.eye(1), noise)


@pytest.mark.slow
def test_without_encoder_noise_nothing_is_biased(counted: tuple[Recording, np.ndarray, np.ndarray]) -> None:
    """Without acceleration errors, or without inertia, the frequency is infinite."""
    recording, _, noise = counted
    assert unbiased_frequencies(replace(recording, floor=np.zeros(1)), np.eye(1), noise) == np.inf
    assert unbiased_frequencies(recording, np.zeros((1, 1)), noise) == np.inf
    assert unbiased_frequencies(replace(recording, ddq=np.zeros((ROWS, 1))), np.eye(1), np.zeros((ROWS, 1))) == np.inf


def test_logs_of_any_length_count(counted: tuple[Recording, np.ndarray, np.ndarray]) -> None:
    """Splitting a log hardly changes the frequency; a few rows alone give no limit."""
    recording, _, noise = counted
    whole = unbiased_frequencies(recording, np.eye(1), noise)
    pieces = replace(recording, starts=(0, ROWS // 2, ROWS - 10))
    assert unbiased_frequencies(pieces, np.eye(1), noise) == pytest.approx(whole, rel=0.05)
    few = cut_recording(recording, slice(0, 10))
    assert unbiased_frequencies(few, np.eye(1), noise[:10]) == np.inf


def test_rows_at_rest_are_distinguished(counted: tuple[Recording, np.ndarray, np.ndarray]) -> None:
    """Adding an equally long rest does not change the frequency."""
    recording, _, noise = counted
    still = np.zeros((ROWS, 1))
    longer = replace(
        recording,
        **{name: np.concatenate([getattr(recording, name), still]) for name in ("q", "dq", "ddq", "tau")},
        t=recording.t[0] + STEP * np.arange(2 * ROWS),
        sign_unknown=np.concatenate([recording.sign_unknown, still == 0.0]),
    )
    whole = unbiased_frequencies(recording, np.eye(1), noise)
    rested = unbiased_frequencies(longer, np.eye(1), np.concatenate([noise, still]), np.array([0.5]))
    assert rested == pytest.approx(whole, abs=0.3)


def test_the_band_passes_slow_signals_and_stops_fast_ones() -> None:
    """The filter passes signals below three quarters of the cut-off unchanged, and stops those above 1.1 times."""
    whitening = estimate_whitening(recording_of(), noise_of(10_000), 0, np.eye(2))
    band = whitening.bands[0]
    t = STEP * np.arange(10_000)
    for frequency, factor in ((0.7 * band.cutoff, 1.0), (1.15 * band.cutoff, 0.0)):
        wave = np.sin(2 * np.pi * frequency * t)
        passed = band.passed(wave)[50:-50]
        # The Kaiser window of shape 6 has ripples of -63 dB.
        assert np.abs(passed - factor * wave[:: band.stride][50:-50]).max() < 2e-3


def test_filtering_columns_together_is_filtering_each() -> None:
    """Filtering columns together equals plain convolution of each, for very different sizes and zeros."""
    rng = np.random.default_rng(0)
    band = estimate_whitening(recording_of(), noise_of(10_000), 0, np.eye(2)).bands[0]
    columns = rng.standard_normal((1000, 5)) * [1.0, 1e9, 0.0, 1e-9, 1.0]
    after = np.array([1.0, -0.5, 0.2])
    together = band.passed(columns, after)
    half = len(band.taps) // 2
    for column, result in zip(columns.T, together.T, strict=True):
        full = np.convolve(column, band.taps)
        # The first rows depend on how the filter extends the log.
        lead = full[half % band.stride :: band.stride]
        first = half // band.stride
        expected = np.convolve(lead, after)[first : first + len(result)]
        assert result == pytest.approx(expected, abs=1e-12 * max(np.abs(column).max(), 1e-300))
        assert result == pytest.approx(band.passed(column, after), abs=1e-12 * np.abs(column).max())
    assert not together[:, 2].any()
    # A subnormal number, whose inverse overflows, such as the cube of a position near zero.
    tiny = band.passed(np.stack([columns[:, 0], np.full(1000, 7e-314)], axis=1), single=True)
    assert tiny[:, 0] == pytest.approx(band.passed(columns[:, 0]), abs=1e-5)
    assert not tiny[:, 1].any()


def test_a_band_without_filter_only_thins() -> None:
    """Without taps every stride-th row is kept unchanged."""
    series = np.arange(10.0)
    assert Band(np.zeros(0), 2, 1.0).passed(series) == pytest.approx(series[::2])


def test_kicks_drown_where_their_torque_is_below_the_noise() -> None:
    """A joint is quiet if the torque of its acceleration error at reversals is below the noise."""
    residual = np.random.default_rng(0).standard_normal((10_000, 2)) * [3.0, 0.5]
    slow = 100.0 * np.sin(0.5 * STEP * np.arange(10_000))[:, None]
    recording = replace(recording_of(), reversal_acceleration_error=np.array([0.9 * 3.0 / 20.0, 1.1 * 0.5 / 2.0]))
    # With 10,000 samples the noise level is known to 1 %.
    assert quiet_joints(recording, residual + slow, np.diag([20.0, 2.0])).tolist() == [True, False]
    assert quiet_joints(recording, 2.0 * residual + slow, np.diag([20.0, 2.0])).tolist() == [True, True]

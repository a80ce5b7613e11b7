"""Specification of the band: what it passes, up to where accelerations bias no fit, and where their kicks drown."""

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
    """A joint of an inertia of 1 kg m2 that moves at random up to 2 Hz, its coarse encoder, and the torque's noise."""
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
    """What a fit of the inertia leaves of its noise-free torque below a frequency, in units of the noise's variance."""
    taps = firwin(2001, frequency, fs=1 / STEP)
    measured, torque = (fftconvolve(x, taps, mode="valid") for x in (recording.ddq[:, 0], true))
    inertia = float(measured @ torque / (measured @ measured))
    return float(np.sum(((1 - inertia) * torque) ** 2)) / NOISE**2


def test_inertia_is_fitted_without_a_bias_that_shows(counted: tuple[Recording, np.ndarray, np.ndarray]) -> None:
    """Up to the frequency that is found, noisy accelerations leave what is allowed; up to twice of it, far more.

    The frequencies are an eighth of a hertz apart, and what is left grows with their tenth power: by a factor of two.
    """
    recording, true, noise = counted
    (frequency,) = unbiased_frequencies(recording, np.eye(1), noise)
    assert 5.0 < frequency < 60.0
    assert 0.4 * MAX_BIAS_CHI2 < _left(recording, true, frequency) < 2.5 * MAX_BIAS_CHI2
    assert _left(recording, true, 2 * frequency) > 100 * MAX_BIAS_CHI2


def test_a_larger_inertia_is_known_further(counted: tuple[Recording, np.ndarray, np.ndarray]) -> None:
    """With the torque, the error grows, and its share of it does not: what it leaves grows with the square."""
    recording, _, noise = counted
    assert unbiased_frequencies(recording, 3 * np.eye(1), noise) < unbiased_frequencies(recording, np.eye(1), noise)


def test_without_encoder_noise_nothing_is_biased(counted: tuple[Recording, np.ndarray, np.ndarray]) -> None:
    """Accelerations without error are known at all frequencies; so are those of a joint that has no torque of them."""
    recording, _, noise = counted
    assert unbiased_frequencies(replace(recording, floor=np.zeros(1)), np.eye(1), noise) == np.inf
    assert unbiased_frequencies(recording, np.zeros((1, 1)), noise) == np.inf
    assert unbiased_frequencies(replace(recording, ddq=np.zeros((ROWS, 1))), np.eye(1), np.zeros((ROWS, 1))) == np.inf


def test_logs_of_any_length_count(counted: tuple[Recording, np.ndarray, np.ndarray]) -> None:
    """Cut into two halves and a few rows, a log says the same; a few rows alone say nothing."""
    recording, _, noise = counted
    whole = unbiased_frequencies(recording, np.eye(1), noise)
    pieces = replace(recording, starts=(0, ROWS // 2, ROWS - 10))
    assert unbiased_frequencies(pieces, np.eye(1), noise) == pytest.approx(whole, rel=0.05)
    few = cut_recording(recording, slice(0, 10))
    assert unbiased_frequencies(few, np.eye(1), noise[:10]) == np.inf


def test_rows_at_rest_are_told_apart(counted: tuple[Recording, np.ndarray, np.ndarray]) -> None:
    """A joint that stands for as long again is known as far as it was: to two steps of the frequencies."""
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
    """Below three quarters of the cut-off a signal comes through unchanged, above 1.1 times it is gone."""
    whitening = estimate_whitening(recording_of(), noise_of(10_000), 0, np.eye(2))
    band = whitening.bands[0]
    t = STEP * np.arange(10_000)
    for frequency, factor in ((0.7 * band.cutoff, 1.0), (1.15 * band.cutoff, 0.0)):
        wave = np.sin(2 * np.pi * frequency * t)
        passed = band.passed(wave)[50:-50]
        # The Kaiser window of shape 6 leaves ripples of 63 dB.
        assert np.abs(passed - factor * wave[:: band.stride][50:-50]).max() < 2e-3


def test_filtering_columns_together_is_filtering_each() -> None:
    """Columns of very different size, and of zeros, come out as convolution written out has them."""
    rng = np.random.default_rng(0)
    band = estimate_whitening(recording_of(), noise_of(10_000), 0, np.eye(2)).bands[0]
    columns = rng.standard_normal((1000, 5)) * [1.0, 1e9, 0.0, 1e-9, 1.0]
    after = np.array([1.0, -0.5, 0.2])
    together = band.passed(columns, after)
    half = len(band.taps) // 2
    for column, result in zip(columns.T, together.T, strict=True):
        full = np.convolve(column, band.taps)
        # The first rows feel what the filter puts before the log.
        lead = full[half % band.stride :: band.stride]
        first = half // band.stride
        expected = np.convolve(lead, after)[first : first + len(result)]
        assert result == pytest.approx(expected, abs=1e-12 * max(np.abs(column).max(), 1e-300))
        assert result == pytest.approx(band.passed(column, after), abs=1e-12 * np.abs(column).max())
    assert not together[:, 2].any()
    # A number so small that one over it is none: the cube of a joint's position that stands at zero.
    tiny = band.passed(np.stack([columns[:, 0], np.full(1000, 7e-314)], axis=1), single=True)
    assert tiny[:, 0] == pytest.approx(band.passed(columns[:, 0]), abs=1e-5)
    assert not tiny[:, 1].any()


def test_a_band_without_filter_only_thins() -> None:
    """Without taps every stride-th row is kept as it is."""
    series = np.arange(10.0)
    assert Band(np.zeros(0), 2, 1.0).passed(series) == pytest.approx(series[::2])


def test_kicks_drown_where_their_torque_is_below_the_noise() -> None:
    """Torque per acceleration times the accelerations' error, over a sample's noise: 0.9 drowns, 1.1 does not."""
    residual = np.random.default_rng(0).standard_normal((10_000, 2)) * [3.0, 0.5]
    slow = 100.0 * np.sin(0.5 * STEP * np.arange(10_000))[:, None]
    recording = replace(recording_of(), reversal_acceleration_error=np.array([0.9 * 3.0 / 20.0, 1.1 * 0.5 / 2.0]))
    # 10 000 samples tell the noise to 1 %.
    assert quiet_joints(recording, residual + slow, np.diag([20.0, 2.0])).tolist() == [True, False]
    assert quiet_joints(recording, 2.0 * residual + slow, np.diag([20.0, 2.0])).tolist() == [True, True]

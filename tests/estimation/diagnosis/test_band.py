"""Specification of the band that accelerations are known in well enough not to bias what is fitted to them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import fftconvolve, firwin

from estimation.diagnosis.band import BIAS, unbiased
from estimation.diagnosis.recording import Recording, cut

STEP, ROWS = 0.004, 250_000
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
        unsure=np.zeros((ROWS, 1), dtype=bool),
        clear=np.zeros((ROWS, 1), dtype=bool),
        jolts=np.zeros(1),
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
    (frequency,) = unbiased(recording, np.eye(1), noise)
    assert 5.0 < frequency < 60.0
    assert 0.4 * BIAS < _left(recording, true, frequency) < 2.5 * BIAS
    assert _left(recording, true, 2 * frequency) > 100 * BIAS


def test_a_larger_inertia_is_known_further(counted: tuple[Recording, np.ndarray, np.ndarray]) -> None:
    """With the torque, the error grows, and its share of it does not: what it leaves grows with the square."""
    recording, _, noise = counted
    assert unbiased(recording, 3 * np.eye(1), noise) < unbiased(recording, np.eye(1), noise)


def test_without_encoder_noise_nothing_is_biased(counted: tuple[Recording, np.ndarray, np.ndarray]) -> None:
    """Accelerations without error are known at all frequencies; so are those of a joint that has no torque of them."""
    recording, _, noise = counted
    assert unbiased(replace(recording, floor=np.zeros(1)), np.eye(1), noise) == np.inf
    assert unbiased(recording, np.zeros((1, 1)), noise) == np.inf
    assert unbiased(replace(recording, ddq=np.zeros((ROWS, 1))), np.eye(1), np.zeros((ROWS, 1))) == np.inf


def test_logs_of_any_length_count(counted: tuple[Recording, np.ndarray, np.ndarray]) -> None:
    """Cut into two halves and a few rows, a log says the same; a few rows alone say nothing."""
    recording, _, noise = counted
    whole = unbiased(recording, np.eye(1), noise)
    pieces = replace(recording, starts=(0, ROWS // 2, ROWS - 10))
    assert unbiased(pieces, np.eye(1), noise) == pytest.approx(whole, rel=0.05)
    few = cut(recording, slice(0, 10))
    assert unbiased(few, np.eye(1), noise[:10]) == np.inf


def test_rows_at_rest_are_told_apart(counted: tuple[Recording, np.ndarray, np.ndarray]) -> None:
    """A joint that stands for as long again is known as far as it was: to two steps of the frequencies."""
    recording, _, noise = counted
    still = np.zeros((ROWS, 1))
    longer = replace(
        recording,
        **{name: np.concatenate([getattr(recording, name), still]) for name in ("q", "dq", "ddq", "tau")},
        t=recording.t[0] + STEP * np.arange(2 * ROWS),
        unsure=np.concatenate([recording.unsure, still == 0.0]),
    )
    whole = unbiased(recording, np.eye(1), noise)
    rested = unbiased(longer, np.eye(1), np.concatenate([noise, still]), np.array([0.5]))
    assert rested == pytest.approx(whole, abs=0.3)

"""Tests of spectral lines, which must not count as noise."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from estimation.diagnosis.noise_models.noise_spectrum import remove_lines

ROWS, STEP = 15_000, 0.004


def _noise(rng: np.random.Generator) -> np.ndarray:
    """Draws noise of two joints, half of it correlated over ten samples."""
    slow = lfilter([np.sqrt(1 - 0.9**2)], [1, -0.9], rng.normal(size=(ROWS, 2)), axis=0)
    return slow + rng.normal(size=(ROWS, 2))


def _power(series: np.ndarray) -> np.ndarray:
    return np.abs(np.fft.rfft(series, axis=0)) ** 2


@pytest.mark.parametrize("period", [None, 10.0])
def test_noise_has_no_lines(period: float | None) -> None:
    """In 30 logs of noise with 450,000 frequencies, fewer than fifty are changed."""
    rng = np.random.default_rng(0)
    touched = 0
    for _ in range(30):
        power = _power(_noise(rng))
        touched += int(np.sum(remove_lines(power, 1 / (ROWS * STEP), period) != power))
    assert touched < 50


@pytest.mark.parametrize(
    ("frequency", "period"), [(3.3, None), (3.31, None), (11.2, None), (47.0, None), (3.31, 10.0), (11.23, 10.0)]
)
def test_a_vibration_is_levelled_to_the_noise_about_it(frequency: float, period: float | None) -> None:
    """A vibration is removed down to the noise level, to 40 %.

    A line between two frequencies of the spectrum spreads over many of them.
    """
    noise = _noise(np.random.default_rng(1))
    t = STEP * np.arange(ROWS)
    shaken = noise + 0.5 * np.sin(2 * np.pi * frequency * t)[:, None]
    near = np.abs(np.fft.rfftfreq(ROWS, STEP) - frequency) < 0.5
    level = _power(noise)[near].mean(axis=0)
    assert np.all(_power(shaken)[near].max(axis=0) > 20 * level)
    left = remove_lines(_power(shaken), 1 / (ROWS * STEP), period)[near].mean(axis=0)
    assert left == pytest.approx(level, rel=0.4)


def test_what_repeats_with_the_motion_is_no_line() -> None:
    """An error at the harmonics of the motion's period is not removed; without the known period it would be."""
    rng = np.random.default_rng(2)
    noise = _noise(rng)
    error = np.tile(rng.normal(size=(2500, 2)), (6, 1))
    power = _power(noise + 2 * error)
    assert np.sum(remove_lines(power, 1 / (ROWS * STEP), 10.0) != power) < 50
    assert np.sum(remove_lines(power, 1 / (ROWS * STEP)) != power) > 100


@pytest.mark.parametrize("rows", [1000, 4000])
def test_a_short_log_tells_no_line(rows: int) -> None:
    """No lines are removed in logs of 4 and 16 s, where a line may be steep coloured noise."""
    power = _power(_noise(np.random.default_rng(3))[:rows] + 5 * np.sin(70.0 * STEP * np.arange(rows))[:, None])
    assert remove_lines(power, 1 / (rows * STEP)) is power

"""Tests of the separation of motion from encoder noise, for even and uneven samples."""

from __future__ import annotations

import numpy as np
import pytest

from estimation.diagnosis.recordings.directions import Directions
from estimation.diagnosis.recordings.position_spectra import Spectra
from estimation.diagnosis.recordings.smoothed_motion import low_pass_gain, smooth_motion
from estimation.preprocessing import Resampled, resample

NOISE = 5e-6  # [rad]
PERIOD = 0.004


def _logged(lost: float, jitter: float = 0.0) -> Resampled:
    """Builds a minute of motion up to 8 Hz with white noise, with lost rows or jitter of the times."""
    rng = np.random.default_rng(4)
    t = PERIOD * np.arange(15_000)
    t = np.sort(t + jitter * PERIOD * rng.uniform(-0.5, 0.5, t.shape))
    t = t[rng.random(t.shape) >= lost]
    frequencies = np.linspace(0.5, 8.0, 16)
    phases = rng.uniform(0, 2 * np.pi, 16)
    q = np.sin(2 * np.pi * frequencies * t[:, None] + phases) @ (0.1 / frequencies**2)
    return resample(t, (q + NOISE * rng.normal(size=t.shape))[:, None])


@pytest.mark.parametrize(("lost", "jitter"), [(0.0, 0.0), (0.05, 0.0), (0.15, 0.0), (0.0, 0.6)])
def test_lost_rows_and_jitter_make_no_motion_of_noise(lost: float, jitter: float) -> None:
    """The cut-off is within an octave above the motion, and the floor is the noise density of the remaining rows.

    The error of a spline over lost rows counts as noise.
    """
    positions = _logged(lost, jitter)
    spectrum = Spectra.of(positions).of_positions(positions.q[:, 0])
    assert 8.0 < spectrum.cutoff() < 16.0
    # White noise with standard deviation s has the density 2 s^2 T up to half of the sample rate.
    assert spectrum.floor == pytest.approx(2 * NOISE**2 * PERIOD / (1 - lost), rel=0.3, abs=0.0)


def test_even_samples_are_taken_as_they_are() -> None:
    """A log with even samples needs no noise simulation."""
    assert not len(Spectra.of(_logged(0.0)).f)


def test_between_two_samples_a_joint_may_have_turned_round() -> None:
    """Interpolated rows have an unknown sign if one of the neighbouring samples has; samples do not change."""
    unsure = np.zeros((8, 2), dtype=bool)
    unsure[2, 0] = unsure[5, 1] = True
    known = Directions(unsure, unsure.copy(), np.zeros(2), np.zeros(2))
    # Rows 1 to 3 lie between samples 0 and 4, row 6 between 5 and 7.
    spread = known.spread(np.array([-1, 1, 1, 1, -1, -1, 2, -1]))
    assert np.flatnonzero(spread.sign_unknown[:, 0]).tolist() == [1, 2, 3]
    assert np.flatnonzero(spread.sign_unknown[:, 1]).tolist() == [5]
    # A sign from the velocity counts in sampled rows only.
    assert np.flatnonzero(spread.sign_known_from_velocity[:, 0]).tolist() == [2]
    assert known.spread(np.full(8, -1)) is known


@pytest.mark.parametrize("noise", [1e-7, 1e-6, 1e-5])
def test_a_motion_that_ends_at_an_edge_keeps_its_last_sine(noise: float) -> None:
    """For sines up to 6.6 Hz the cut-off loses less than noise adds, or less than 1 % of the acceleration.

    A cut-off at 7 Hz, where the spectrum meets the noise, would lose a quarter of the last sine.
    """
    rng = np.random.default_rng(2)
    t = PERIOD * np.arange(10_000)
    frequencies = np.arange(0.5, 6.7, 0.1)
    sines = np.sin(2 * np.pi * frequencies * t[:, None] + rng.uniform(0, 2 * np.pi, len(frequencies)))
    q, a = sines @ (0.02 / frequencies**2), -0.02 * (2 * np.pi) ** 2 * sines.sum(axis=1)
    positions = resample(t, (q + noise * rng.normal(size=t.shape))[:, None])
    cutoff = Spectra.of(positions).of_positions(positions.q[:, 0]).cutoff()
    middle = slice(2000, -2000)

    def error(x: np.ndarray, cutoff: float) -> float:
        found = smooth_motion(x[:, None], PERIOD, np.array([cutoff]))[2][middle, 0]
        return float(np.sqrt(np.mean((found - a[middle]) ** 2)) / a.std())

    lost, both = error(q, cutoff), error(positions.q[:, 0], cutoff)
    assert lost < max(0.01, both)
    assert lost**2 < 0.6 * both**2 or lost < 0.01
    assert error(q, 7.0) > 0.04
    assert low_pass_gain(np.array([6.6]), 7.0) == pytest.approx(0.72, abs=0.01)

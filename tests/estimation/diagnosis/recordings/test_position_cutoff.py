"""Tests of the frequency up to which positions are motion."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from estimation.diagnosis.recordings.log_reading import build_recording
from estimation.diagnosis.recordings.position_spectra import CAPS, Spectra, select_position_cutoff
from estimation.diagnosis.recordings.smoothed_motion import smooth_motion
from estimation.regressions.preparation import prepare
from robots.plants import simulate
from robots.robot import Robot
from robots.signals import Log


def smeared(log: Log, size: float) -> Log:
    """Adds position noise that is correlated over 50 samples, so that its spectrum falls like that of motion."""
    rng = np.random.default_rng(0)
    noise = lfilter([np.sqrt(1 - 0.98**2)], [1, -0.98], rng.standard_normal(log.q.shape), axis=0)
    return replace(log, q=log.q + size * noise)


@pytest.fixture(scope="module")
def logs(arm_plant: Callable, fourier_motion: Callable, arm: Robot) -> tuple[Log, Log]:
    """Returns a log with a fine encoder, and the same with coloured position noise of 0.5 mrad."""
    log = simulate(arm_plant(torque_noise=0.02), fourier_motion(arm, 4))
    return log, smeared(log, 5e-4)


@pytest.mark.slow
def test_coloured_noise_is_kept_out_of_the_acceleration(arm: Robot, logs: tuple[Log, Log], fourier_motion) -> None:
    """With coloured noise, the acceleration error is less than a third of that with the cut-off from the spectrum."""
    noisy = logs[1]
    prepared = prepare(arm, noisy)
    spectra = Spectra.of(prepared.positions)
    given = np.array([spectra.of_positions(x).cutoff() for x in prepared.positions.q.T])
    assert select_position_cutoff(arm, [prepared], given) in CAPS
    truth = fourier_motion(arm, 4)

    def error(t: np.ndarray, ddq: np.ndarray) -> float:
        expected = np.column_stack([np.interp(t, truth.t, x) for x in truth.ddq.T])
        return float(np.sqrt(np.mean((ddq - expected) ** 2) / np.mean(expected**2)))

    recording = build_recording(arm, [noisy])
    uncapped = smooth_motion(prepared.positions.q, prepared.positions.period, given)[2]
    assert error(recording.t, recording.ddq) < error(prepared.positions.t, uncapped) / 3


def test_a_good_encoder_keeps_its_band(arm: Robot, logs: tuple[Log, Log]) -> None:
    """With a good encoder the cut-off is not lowered."""
    assert select_position_cutoff(arm, [prepare(arm, logs[0])], np.full(2, 40.0)) == np.inf


def test_an_elastic_gear_is_no_noise(arm: Robot, arm_plant: Callable, fourier_motion: Callable) -> None:
    """A residual of 5 % by an effect does not count as position noise."""
    log = simulate(arm_plant(torque_noise=0.02), fourier_motion(arm, 5))
    late = replace(log, tau=np.column_stack([np.interp(log.t - 0.01, log.t, x) for x in log.tau.T]))
    assert select_position_cutoff(arm, [prepare(arm, late)], np.full(2, 40.0)) == np.inf

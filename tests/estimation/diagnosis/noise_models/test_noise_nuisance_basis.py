"""Tests of the noise model: neither effects nor rests change it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from estimation.diagnosis.base_models.baseline import base_model_prior, base_parameters, build_baseline
from estimation.diagnosis.noise_models.noise_estimate import estimate_whitening
from estimation.diagnosis.noise_models.noise_nuisance_basis import build_nuisance_projection
from estimation.diagnosis.noise_models.whitening import Whitening
from estimation.diagnosis.recordings.log_reading import build_recording
from estimation.diagnosis.recordings.recording import Recording
from robots.plants import simulate
from robots.robot import Robot
from robots.signals import Motion

SLOW = np.array([0.3, 1.0, 1.5, 2.0, 3.0])  # [Hz]
NOISE = 0.1  # [N m], with a correlation of 0.8 between consecutive samples


def _moves(seed: int) -> Motion:
    """Builds sixty seconds of quintic moves between random points, with pauses of 0.1 to 0.8 s."""
    rng = np.random.default_rng(seed)
    t = 0.004 * np.arange(15_000)
    q, dq, ddq = np.zeros((3, len(t), 2))
    at, begin = np.zeros(2), 0.5
    while begin < 61.0:
        to = rng.uniform(-1.5, 1.5, 2)
        rows = t >= begin
        u, span = np.clip((t[rows, None] - begin) / 0.8, 0, 1), to - at
        q[rows] = at + span * u**3 * (10 - 15 * u + 6 * u**2)
        dq[rows] = span * 30 * u**2 * (1 - u) ** 2 / 0.8
        ddq[rows] = span * 60 * u * (1 - u) * (1 - 2 * u) / 0.8**2
        at, begin = to, begin + 0.8 + rng.uniform(0.1, 0.8)
    return Motion(t, q, dq, ddq)


def _density(whitening: Whitening, recording: Recording, joint: int) -> np.ndarray:
    """Evaluates the noise model's power density at some frequencies [N^2 m^2 / Hz]."""
    step, a = recording.step * whitening.bands[joint].stride, whitening.coefficients[joint]
    lags = np.exp(-2j * np.pi * step * SLOW[:, None] * np.arange(1, len(a) + 1))
    return np.asarray(2 * step * whitening.scale[joint] ** 2 / np.abs(1 - lags @ a) ** 2)


@pytest.mark.slow
@pytest.mark.parametrize("stiffness", [0.0, 1.5])
def test_neither_rests_nor_effects_colour_the_noise(arm: Robot, arm_plant: Callable, stiffness: float) -> None:
    """With rests and a cubic spring of ten times the noise, the density is right to a factor of 1.5.

    The spring in the residual would be 50 times the noise at 1 Hz. With some 60 frequencies per hertz, the standard
    error of the extrapolation below 1 Hz is 20 %.
    """
    motion = _moves(0)
    log = simulate(arm_plant(torque_noise=0.0), motion, seed=0)
    rng = np.random.default_rng(1)
    noise = lfilter([NOISE * np.sqrt(1 - 0.8**2)], [1.0, -0.8], rng.standard_normal(log.tau.shape), axis=0)
    tau = log.tau + noise + stiffness * np.column_stack([motion.q[:, 0] ** 3, np.zeros(len(motion.t))])
    recording = build_recording(arm, [replace(log, tau=tau)])
    baseline = build_baseline(base_parameters(arm, "coulomb-viscous", (0.001, 0.001)), recording)
    pull = base_model_prior(baseline, recording)
    values = baseline.fitted(~recording.sign_unknown / recording.tau.std(axis=0), recording.tau, pull)
    residual = recording.tau - baseline.regressor @ values
    assert recording.sign_unknown.mean() > 0.2
    spared = build_nuisance_projection(recording, baseline, residual)
    found = estimate_whitening(recording, residual, baseline.base.size, np.eye(2), spared=spared)
    true = 2 * 0.004 * NOISE**2 * (1 - 0.8**2) / np.abs(1 - 0.8 * np.exp(-2j * np.pi * 0.004 * SLOW)) ** 2
    for joint in range(2):
        assert np.all(np.abs(np.log(_density(found, recording, joint) / true)) < np.log(1.5))
    if stiffness:
        naive = estimate_whitening(recording, residual, baseline.base.size, np.eye(2))
        assert _density(naive, recording, 0)[1] > 10 * true[1]


@pytest.mark.slow
def test_a_short_log_has_no_free_functions(arm: Robot, arm_plant: Callable) -> None:
    """A log of ten seconds has no nuisance functions, because they would absorb the noise."""
    log = simulate(arm_plant(torque_noise=0.01), _moves(0), seed=0)
    short = replace(log, t=log.t[:2500], q=log.q[:2500], tau=log.tau[:2500])
    recording = build_recording(arm, [short])
    baseline = build_baseline(base_parameters(arm, "coulomb-viscous", (0.001, 0.001)), recording)
    assert build_nuisance_projection(recording, baseline, recording.tau) == ()

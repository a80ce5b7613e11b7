"""Tests of short events in a residual that must not count as noise."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from estimation import diagnose
from estimation.diagnosis.noise_models.noise_estimate import find_bursts
from robots.plants import simulate
from robots.robot import Robot
from robots.signals import Motion

STEP = 0.02


def coloured(rng: np.random.Generator, rows: int, memory: float) -> np.ndarray:
    """Draws noise (rows, 2) of unit variance with a given correlation between consecutive samples."""
    drawn = rng.standard_normal((rows + 500, 2))
    return lfilter([np.sqrt(1 - memory**2)], [1, -memory], drawn, axis=0)[500:]


@pytest.mark.parametrize("memory", [0.0, 0.9, 0.98])
def test_noise_has_no_bursts(memory: float) -> None:
    """No burst is found in 100 logs of a minute, for fast and slow noise."""
    for seed in range(100):
        noise = coloured(np.random.default_rng(seed), 3000, memory)
        assert not find_bursts([noise], np.ones(noise.shape, dtype=bool), STEP).any()


def test_a_push_is_marked_on_its_joint() -> None:
    """A push is flagged with half a second around it on its joint; spikes and frequent events are not."""
    noise = coloured(np.random.default_rng(1), 3000, 0.5)
    pushed = noise.copy()
    pushed[1000:1060, 1] += 8.0
    marked = find_bursts([noise, pushed], np.ones((6000, 2), dtype=bool), STEP)
    assert not marked[:, 0].any()
    assert marked[4000:4060, 1].all()
    assert set(np.flatnonzero(marked[:, 1])) <= set(range(3940, 4120))
    spiky = noise.copy()
    spiky[::100, 0] += 30.0
    often = noise.copy()
    often[np.arange(3000) % 400 < 60, 0] += 8.0
    for piece in (spiky, often):
        assert not find_bursts([piece], np.ones((3000, 2), dtype=bool), STEP).any()


def test_rows_that_do_not_count_are_no_measure() -> None:
    """The level is estimated from rows that count; a joint without such rows has no bursts."""
    noise = coloured(np.random.default_rng(2), 3000, 0.5)
    measured = np.zeros((3000, 2), dtype=bool)
    measured[:600, 0] = True
    assert not find_bursts([noise * measured], measured, STEP).any()


@pytest.mark.longer
def test_a_hard_push_does_not_hide_in_its_own_noise(
    arm: Robot, arm_plant: Callable, fourier_motion: Callable[..., Motion]
) -> None:
    """A constant torque of 1.5 s on one joint is found as a contact, with its time."""
    log = simulate(arm_plant(torque_noise=0.0), fourier_motion(arm, 5, duration=40.0), seed=5)
    during = (log.t > 21.3) & (log.t < 22.8)
    tau = log.tau + 0.025 * log.tau.std(axis=0) * coloured(np.random.default_rng(5), len(log.t), 0.8)
    tau[:, 0] += during * 0.02 * log.tau[:, 0].std() / np.sqrt(during.mean())
    diagnosis = diagnose(arm, replace(log, tau=tau), friction="coulomb-viscous")
    (finding,) = diagnosis.findings
    assert finding.effect == "external_contact"
    start, duration = (p for p in finding.parameters if p.name in ("start", "duration"))
    assert start.value == pytest.approx(21.3, abs=0.1)
    assert duration.value == pytest.approx(1.5, abs=0.2)

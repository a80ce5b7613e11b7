"""Tests of the noise-free motion from counted positions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from estimation.diagnosis.recordings.log_reading import build_recording
from robots.common.errors import InputError
from robots.robot import Robot
from robots.signals import Log, Motion


def _log(motion: Motion, counts: float) -> Log:
    count = 2 * np.pi / counts
    return Log(t=motion.t, q=np.round(motion.q / count) * count, tau=np.ones_like(motion.q))


def _aperiodic(motion: Callable[..., Motion], arm: Robot) -> Motion:
    return motion(arm, duration=9.9)  # one pass, not quite


def test_derivatives_of_a_single_pass_are_free_of_encoder_noise(arm: Robot, fourier_motion: Callable) -> None:
    """With 2^17 counts per turn, accelerations have errors below 2 %; finite differences have 50 %."""
    motion = _aperiodic(fourier_motion, arm)
    recording = build_recording(arm, [_log(motion, 2**17)])
    first = int(np.argmin(np.abs(motion.t - recording.t[0])))
    rows = slice(first, first + len(recording))
    assert recording.t == pytest.approx(motion.t[rows])
    assert recording.cycles == (None,)
    size = motion.ddq.std(axis=0)
    inner = slice(100, -100)
    assert np.all((recording.ddq - motion.ddq[rows])[inner].std(axis=0) < 0.02 * size)
    assert np.all((recording.dq - motion.dq[rows])[inner].std(axis=0) < 0.005 * motion.dq.std(axis=0))


def test_a_repeated_motion_is_known_better_than_a_single_pass(arm: Robot, fourier_motion: Callable) -> None:
    """For a repeated motion the period is found, and accelerations have errors below 1 %."""
    motion = fourier_motion(arm, duration=40.0)
    recording = build_recording(arm, [_log(motion, 2**17)])
    assert recording.periodic
    assert recording.cycles[0] is not None
    assert recording.cycles[0].period == pytest.approx(10.0, abs=1e-4)
    first = int(np.argmin(np.abs(motion.t - recording.t[0])))
    error = recording.ddq - motion.ddq[first : first + len(recording)]
    assert np.all(error[200:-200].std(axis=0) < 0.01 * motion.ddq.std(axis=0))


@pytest.mark.slow
def test_a_log_that_begins_in_motion_is_known_to_its_ends(arm: Robot) -> None:
    """With a fine encoder, acceleration errors at the ends are at most 1.5 times those in the middle."""
    rng = np.random.default_rng(0)
    t, f = 0.004 * np.arange(5000), np.linspace(0.1, 60.0, 600)[:, None]
    phases = 2 * np.pi * (f[:, :, None] * t[:, None] + rng.uniform(size=(600, 1, 2)))
    q = np.sum(np.sin(phases) / (1 + f[:, :, None]) ** 4, axis=0)
    ddq = -np.sum((2 * np.pi * f[:, :, None]) ** 2 * np.sin(phases) / (1 + f[:, :, None]) ** 4, axis=0)
    count = 1e-7
    recording = build_recording(arm, [Log(t=t, q=np.round(q / count) * count, tau=np.ones_like(q))])
    first = int(np.argmin(np.abs(t - recording.t[0])))
    error = np.abs(recording.ddq - ddq[first : first + len(recording)])
    ends = np.concatenate([error[:20], error[-20:]])
    assert np.all(ends.max(axis=0) < 1.5 * error[100:-100].max(axis=0))


def test_a_slow_motion_is_known_to_the_ends_of_a_log_that_cuts_it(arm: Robot) -> None:
    """For sines below 0.8 Hz, acceleration errors at the ends are at most ten times those in the middle.

    A filter that mirrors the motion at the ends has 500 times the error there. The test fails by chance once in 1,000.
    """
    rng = np.random.default_rng(1)
    t, w = 0.004 * np.arange(15000), 2 * np.pi * rng.uniform(0.1, 0.8, size=(3, 1, 2))
    phases = w * t[:, None] + rng.uniform(0, 2 * np.pi, size=(3, 1, 2))
    count = 2 * np.pi / 2**18
    q = np.round(np.sin(phases).sum(axis=0) / count) * count
    ddq = -(w**2 * np.sin(phases)).sum(axis=0)
    recording = build_recording(arm, [Log(t=t, q=q, tau=np.ones_like(q))])
    first = int(np.argmin(np.abs(t - recording.t[0])))
    error = recording.ddq - ddq[first : first + len(recording)]
    within = error[4000:-4000].std(axis=0)
    for end in (error[:250], error[-250:]):
        assert np.all(np.sqrt(np.mean(end**2, axis=0)) < 10 * within)


@pytest.mark.slow
def test_logs_share_one_clock(arm: Robot, fourier_motion: Callable) -> None:
    """Logs are ordered by their times; overlapping logs are refused."""
    log = _log(fourier_motion(arm, duration=20.0), 2**20)
    later = replace(log, t=np.asarray(log.t) + 60.0)
    recording = build_recording(arm, [later, log])
    assert len(recording.starts) == 2
    assert np.all(np.diff(recording.t) > 0)
    with pytest.raises(InputError, match="overlaps"):
        build_recording(arm, [log, replace(log, t=np.asarray(log.t) + 5.0)])

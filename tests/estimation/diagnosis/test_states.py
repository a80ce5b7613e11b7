"""Specification of noise-free motion from counted positions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from estimation.diagnosis.states import record, spans
from robots.common.errors import InputError
from robots.robot import Robot
from robots.signals import Log, Motion


def _log(motion: Motion, counts: float) -> Log:
    count = 2 * np.pi / counts
    return Log(t=motion.t, q=np.round(motion.q / count) * count, tau=np.ones_like(motion.q))


def _aperiodic(motion: Callable[..., Motion], arm: Robot) -> Motion:
    return motion(arm, duration=9.9)  # one pass, not quite


def test_derivatives_of_a_single_pass_are_free_of_encoder_noise(arm: Robot, fourier_motion: Callable) -> None:
    """With 2^17 counts a turn accelerations err by less than 2 % of their size; differences would by half of it."""
    motion = _aperiodic(fourier_motion, arm)
    recording = record(arm, [_log(motion, 2**17)])
    first = int(np.argmin(np.abs(motion.t - recording.t[0])))
    rows = slice(first, first + len(recording))
    assert recording.t == pytest.approx(motion.t[rows])
    assert recording.cycles == (None,)
    size = motion.ddq.std(axis=0)
    inner = slice(100, -100)
    assert np.all((recording.ddq - motion.ddq[rows])[inner].std(axis=0) < 0.02 * size)
    assert np.all((recording.dq - motion.dq[rows])[inner].std(axis=0) < 0.005 * motion.dq.std(axis=0))


def test_a_repeated_motion_is_known_better_than_a_single_pass(arm: Robot, fourier_motion: Callable) -> None:
    """Two passes and more are averaged: the cycle is found and accelerations err by less than 1 %."""
    motion = fourier_motion(arm, duration=40.0)
    recording = record(arm, [_log(motion, 2**17)])
    assert recording.periodic
    assert recording.cycles[0] is not None
    assert recording.cycles[0].period == pytest.approx(10.0, abs=1e-4)
    first = int(np.argmin(np.abs(motion.t - recording.t[0])))
    error = recording.ddq - motion.ddq[first : first + len(recording)]
    assert np.all(error[200:-200].std(axis=0) < 0.01 * motion.ddq.std(axis=0))


def test_a_log_that_begins_in_motion_is_known_to_its_ends(arm: Robot) -> None:
    """A fine encoder's accelerations err no more at the ends of a log than in its middle: filters have rung out."""
    rng = np.random.default_rng(0)
    t, f = 0.004 * np.arange(5000), np.linspace(0.1, 60.0, 600)[:, None]
    phases = 2 * np.pi * (f[:, :, None] * t[:, None] + rng.uniform(size=(600, 1, 2)))
    q = np.sum(np.sin(phases) / (1 + f[:, :, None]) ** 4, axis=0)
    ddq = -np.sum((2 * np.pi * f[:, :, None]) ** 2 * np.sin(phases) / (1 + f[:, :, None]) ** 4, axis=0)
    count = 1e-7
    recording = record(arm, [Log(t=t, q=np.round(q / count) * count, tau=np.ones_like(q))])
    first = int(np.argmin(np.abs(t - recording.t[0])))
    error = np.abs(recording.ddq - ddq[first : first + len(recording)])
    ends = np.concatenate([error[:20], error[-20:]])
    assert np.all(ends.max(axis=0) < 1.5 * error[100:-100].max(axis=0))


def test_rows_about_a_reversal_are_unsure(arm: Robot, fourier_motion: Callable) -> None:
    """Wherever a joint reverses, the rows beside do not count; they are few."""
    recording = record(arm, [_log(fourier_motion(arm, duration=20.0), 2**20)])
    turned = recording.dq[1:] * recording.dq[:-1] < 0
    assert recording.unsure[1:][turned].all()
    assert recording.unsure.mean() < 0.15


def _beside(log: Log, arm: Robot) -> float:
    """Rows flagged at each reversal of the shoulder, slow ones not counted."""
    recording = record(arm, [log])
    dq, unsure = recording.dq[:, 0], recording.unsure[:, 0]
    turns = np.flatnonzero(dq[1:] * dq[:-1] < 0)
    sharp = [k for k in turns if np.abs(recording.ddq[k, 0]) > 0.3 * recording.ddq[:, 0].std()]
    lengths = [stop - start for k in sharp for start, stop in spans(unsure) if start <= k < stop]
    return float(np.median(lengths))


def test_no_more_rows_are_lost_at_a_reversal_than_a_kick_spreads_to(arm: Robot, fourier_motion: Callable) -> None:
    """Two where the motion has no kicks, or they are known to a sample; six where they are not.

    Friction of 2 N m that turns round kicks the shoulder by 2 rad/s2: a position known up to 12 Hz only has that kick
    spread over a dozen rows of 4 ms, one known up to 100 Hz has it within a row.
    """
    motion = _aperiodic(fourier_motion, arm)
    kick = np.cumsum(np.cumsum(-2.0 * np.sign(motion.dq[:, 0]))) * 0.004**2
    kicked = motion.q.copy()
    kicked[:, 0] += kick - np.polynomial.Polynomial.fit(motion.t, kick, 3)(motion.t)

    def log(q: np.ndarray, counts: float) -> Log:
        count = 2 * np.pi / counts
        return Log(t=motion.t, q=np.round(q / count) * count, tau=np.ones_like(q))

    assert _beside(log(motion.q, 2**40), arm) == 2
    assert _beside(log(kicked, 2**40), arm) == 2
    assert _beside(log(kicked, 2**15), arm) >= 6


def test_torque_between_samples_is_not_trusted_beside_a_reversal(arm: Robot, fourier_motion: Callable) -> None:
    """Sampled at uneven times it is read off straight lines, across the sign's jump."""
    motion = _aperiodic(fourier_motion, arm)
    even = Log(t=motion.t, q=motion.q, tau=np.ones_like(motion.q))
    shaken = motion.t + 1e-3 * np.random.default_rng(0).uniform(-1, 1, len(motion.t))
    spline = CubicSpline(motion.t, motion.q)
    assert _beside(even, arm) == 2
    assert _beside(Log(t=shaken, q=spline(shaken), tau=even.tau), arm) >= 6


def test_logs_share_one_clock(arm: Robot, fourier_motion: Callable) -> None:
    """Logs are put in the order of their times; two at one time are refused, naming the column."""
    log = _log(fourier_motion(arm, duration=20.0), 2**20)
    later = replace(log, t=np.asarray(log.t) + 60.0)
    recording = record(arm, [later, log])
    assert len(recording.starts) == 2
    assert np.all(np.diff(recording.t) > 0)
    with pytest.raises(InputError, match="overlaps"):
        record(arm, [log, replace(log, t=np.asarray(log.t) + 5.0)])


def test_stretches_are_listed() -> None:
    """Half-open, in order, at the ends too."""
    assert spans(np.array([1, 0, 1, 1, 0, 1], dtype=bool)) == [(0, 1), (2, 4), (5, 6)]

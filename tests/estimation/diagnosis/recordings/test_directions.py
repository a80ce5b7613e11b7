"""Tests of the rows in which the direction of motion is unknown."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from estimation.diagnosis.calibration import MIN_SHARP_SPEED_SIGMAS
from estimation.diagnosis.recordings.directions import ALIKE
from estimation.diagnosis.recordings.log_reading import build_recording
from estimation.diagnosis.recordings.recording import Recording, cut_recording
from robots.common.stretches import spans
from robots.robot import Robot
from robots.signals import Log, Motion

Array = NDArray[np.float64]

KICK = 1.0
STEP, FINE = 0.004, 16


def _aperiodic(motion: Callable[..., Motion], arm: Robot) -> Motion:
    return motion(arm, duration=9.9)  # one pass, not quite


def _counted(motion: Motion, q: Array, counts: float) -> Log:
    count = 2 * np.pi / counts
    return Log(t=motion.t, q=np.round(q / count) * count, tau=np.ones_like(q))


def _kicked(motion: Motion, friction: float = KICK, loop: float = 1.0) -> tuple[Array, Array, Array]:
    """Simulates a motion whose shoulder acceleration jumps at each reversal, and its derivatives.

    Friction [rad/s2] acts under a position loop [Hz]; the acceleration is constant within a sixteenth of a step.
    """
    q, dq, ddq = motion.q.copy(), motion.dq.copy(), motion.ddq.copy()
    wanted = CubicSpline(motion.t, np.column_stack([motion.q[:, 0], motion.dq[:, 0], motion.ddq[:, 0]]))
    stiff, damped, h = (2 * np.pi * loop) ** 2, 4 * np.pi * loop, STEP / FINE
    way, speed = float(q[0, 0]), float(dq[0, 0])
    for k, (place, rate, curve) in enumerate(wanted(motion.t[0] + h * np.arange(FINE * len(q))).tolist()):
        force = curve + stiff * (place - way) + damped * (rate - speed) - friction * np.sign(speed)
        if k % FINE == 0:
            q[k // FINE, 0], dq[k // FINE, 0], ddq[k // FINE, 0] = way, speed, force
        way, speed = way + speed * h + force * h**2 / 2, speed + force * h
    return q, dq, ddq


def _trusting(arm: Robot, log: Log) -> Recording:
    """Builds a recording in which all rows with a clear sign count."""
    return build_recording(arm, [log]).with_trusted(np.ones(2, dtype=bool))


def _beside(log: Log, arm: Robot) -> float:
    """Returns the median number of rows flagged at a reversal of the shoulder, without slow reversals."""
    recording = _trusting(arm, log)
    dq, unsure = recording.dq[:, 0], recording.sign_unknown[:, 0]
    turns = np.flatnonzero(dq[1:] * dq[:-1] < 0)
    sharp = [k for k in turns if np.abs(recording.ddq[k, 0]) > 0.3 * recording.ddq[:, 0].std()]
    found = [[b - a for a, b in spans(unsure) if a - 1 <= k < b] for k in sharp]
    return float(np.median([sum(lengths) for lengths in found]))


def _beside_reversals(v: Array) -> NDArray[np.intp]:
    """Returns the rows from two before to three after each sign change of a velocity (N,)."""
    turns = np.flatnonzero(v[1:] * v[:-1] < 0)
    return np.unique(np.clip(turns[:, None] + np.arange(-2, 4), 0, len(v) - 1))


def test_few_rows_are_lost(arm: Robot, fourier_motion: Callable) -> None:
    """With a coarse encoder all rows next to a reversal are flagged, less than 15 % in total."""
    motion = fourier_motion(arm, duration=20.0)
    recording = _trusting(arm, _counted(motion, motion.q, 2**12))
    turned = recording.dq[1:] * recording.dq[:-1] < 0
    assert recording.sign_unknown[1:][turned].all()
    assert recording.sign_unknown.mean() < 0.15


@pytest.mark.slow
def test_no_more_rows_are_lost_at_a_reversal_than_a_kick_spreads_to(arm: Robot, fourier_motion: Callable) -> None:
    """Without jumps of acceleration no row is flagged; with a fine encoder two, with a coarse one six or more.

    A position known up to 12 Hz spreads a jump over a dozen rows of 4 ms; one known up to 100 Hz keeps it within a row.
    """
    motion = _aperiodic(fourier_motion, arm)
    kicked, _, _ = _kicked(motion)
    assert _beside(_counted(motion, motion.q, 2**40), arm) == 0
    assert _beside(_counted(motion, kicked, 2**40), arm) == 2
    assert _beside(_counted(motion, kicked, 2**15), arm) >= 6


@pytest.mark.slow
@pytest.mark.parametrize("counts", [2.0**15, 2.0**20, 2.0**26, 2.0**40])
def test_rows_that_count_beside_a_reversal_have_a_velocity_that_is_known(
    arm: Robot, fourier_motion: Callable, counts: float
) -> None:
    """Velocities that count within three rows of a reversal have a small relative error.

    The rule bounds the error by one part in `MIN_SHARP_SPEED_SIGMAS` of the velocity. A third more is allowed for
    single rows, and the change of velocity within the time error of two clocks.
    """
    motion = _aperiodic(fourier_motion, arm)
    for q, dq, _ in ((motion.q, motion.dq, motion.ddq), _kicked(motion)):
        recording = _trusting(arm, _counted(motion, q, counts))
        first = int(np.argmin(np.abs(motion.t - recording.t[0])))
        true = dq[first : first + len(recording), 0]
        near = _beside_reversals(true)
        counted = near[~recording.sign_unknown[near, 0]]
        error = np.abs(recording.dq[counted, 0] - true[counted])
        change = np.abs(recording.ddq[counted, 0]) * STEP
        assert np.all(error < np.maximum(4 / 3 / MIN_SHARP_SPEED_SIGMAS * np.abs(true[counted]), ALIKE * change))
        assert len(counted) > 0 or counts < 2**18


def test_rows_beside_a_reversal_count_of_joints_that_are_trusted_alone(arm: Robot, fourier_motion: Callable) -> None:
    """Rows next to a reversal count only on trusted joints."""
    motion = _aperiodic(fourier_motion, arm)
    plain = build_recording(arm, [_counted(motion, motion.q, 2**40)])
    turned = np.zeros(plain.dq.shape, dtype=bool)
    turned[1:] = plain.dq[1:] * plain.dq[:-1] < 0
    assert plain.sign_unknown[turned].all()
    assert plain.with_trusted(None) is plain
    trusting = plain.with_trusted(np.array([True, False]))
    assert not trusting.sign_unknown[turned[:, 0], 0].all()
    assert trusting.sign_unknown[:, 1] == pytest.approx(plain.sign_unknown[:, 1])
    assert cut_recording(trusting, slice(100, 200)).sign_known_from_velocity == pytest.approx(
        plain.sign_known_from_velocity[100:200]
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("counts", "loop", "most"),
    [
        (2.0**20, 1.0, 3.0),
        (2.0**26, 1.0, 3.0),
        (2.0**17, 1.0, 20.0),
        # With a loop of 12 Hz, a jump has almost no energy at the few hertz where this motion's spectrum ends.
        (2.0**17, 12.0, 20.0),
    ],
)
def test_a_jolt_is_what_a_kick_may_leave_of_the_acceleration(
    arm: Robot, fourier_motion: Callable, counts: float, loop: float, most: float
) -> None:
    """The acceleration error at reversals is not underestimated by more than a factor of two.

    For a motion without jumps it is at most a thirtieth of that.
    """
    motion = _aperiodic(fourier_motion, arm)
    q, _, ddq = _kicked(motion, loop=loop)
    recording = build_recording(arm, [_counted(motion, q, counts)])
    first = int(np.argmin(np.abs(motion.t - recording.t[0])))
    true = ddq[first : first + len(recording), 0]
    turns = np.flatnonzero(recording.dq[1:, 0] * recording.dq[:-1, 0] < 0)
    near = np.unique(np.clip(turns[:, None] + np.arange(-2, 4), 0, len(true) - 1))
    error = float(np.sqrt(np.mean((recording.ddq[near, 0] - true[near]) ** 2)))
    assert error / 2 < recording.reversal_acceleration_error[0] < most * error
    smooth = build_recording(arm, [_counted(motion, motion.q, 2**26)])
    assert smooth.reversal_acceleration_error[0] < recording.reversal_acceleration_error[0] / 30


@pytest.mark.slow
@pytest.mark.parametrize("counts", [2.0**26, 2.0**30, 2.0**40])
def test_moments_of_reversals_are_as_wrong_as_is_said(arm: Robot, fourier_motion: Callable, counts: float) -> None:
    """The error of reversal times is estimated within a factor of three."""
    motion = _aperiodic(fourier_motion, arm)
    q, dq, _ = _kicked(motion)
    recording = build_recording(arm, [_counted(motion, q, counts)])
    first = int(np.argmin(np.abs(motion.t - recording.t[0])))
    turns = _crossings(recording.dq[:, 0])
    errors = turns - _crossings(dq[first : first + len(recording), 0])
    assert len(errors) >= 5
    assert recording.reversal_time_error is not None
    usual, told = STEP * np.abs(errors), recording.reversal_time_error[turns.astype(int), 0]
    assert 1 / 3 < np.sqrt(np.mean(told**2) / np.mean(usual**2)) < 3


def _crossings(v: np.ndarray) -> np.ndarray:
    """Returns the fractional rows at which a velocity (N,) changes its sign."""
    at = np.flatnonzero(v[1:] * v[:-1] < 0)
    return at + v[at] / (v[at] - v[at + 1])


def test_torque_between_samples_is_not_trusted_beside_a_reversal(arm: Robot, fourier_motion: Callable) -> None:
    """With uneven samples rows next to reversals are flagged, because torque is interpolated across the sign change."""
    motion = _aperiodic(fourier_motion, arm)
    shaken = motion.t + 1e-3 * np.random.default_rng(0).uniform(-1, 1, len(motion.t))
    spline = CubicSpline(motion.t, motion.q)
    assert _beside(_counted(motion, motion.q, 2**40), arm) == 0
    assert _beside(Log(t=shaken, q=spline(shaken), tau=np.ones_like(motion.q)), arm) >= 6


@pytest.fixture(scope="module")
def long_motion(arm: Robot, fourier_motion: Callable) -> Callable[[float, float], tuple[Motion, Array, Array]]:
    """Simulates a minute of motion with jumps of acceleration, once for all encoders."""

    @cache
    def build(friction: float, loop: float) -> tuple[Motion, Array, Array]:
        motion = fourier_motion(arm, duration=59.9)
        q, dq, _ = _kicked(motion, friction=friction, loop=loop)
        return motion, q, dq

    return build


@pytest.mark.slow
@pytest.mark.parametrize("counts", [2.0**17, 2.0**20, 2.0**24])
@pytest.mark.parametrize(
    ("friction", "loop"),
    [
        (0.0, 1.0),
        (0.03, 12.0),
        pytest.param(0.3, 12.0, marks=pytest.mark.longer),
        pytest.param(1.0, 20.0, marks=pytest.mark.longer),
        (3.0, 30.0),
    ],
)
def test_positions_beside_reversals_tell_how_well_those_are_known(
    arm: Robot,
    long_motion: Callable[[float, float], tuple[Motion, Array, Array]],
    friction: float,
    loop: float,
    counts: float,
) -> None:
    """Rows that count have a velocity known to an eighth, except for 1 %, for any jump of acceleration and encoder.

    In the spectrum of a slow motion the jumps are below the encoder's noise, but next to reversals they show, or are
    small. Without jumps an encoder of a million counts gives reversal times to 0.3 ms.
    """
    motion, q, dq = long_motion(friction, loop)
    recording = _trusting(arm, _counted(motion, q, counts))
    assert recording.reversal_time_error is not None
    if friction == 0.0 and counts >= 2**20:
        late = recording.reversal_time_error[_crossings(recording.dq[:, 0]).astype(int), 0]
        assert 0.0 < late.min() <= late.max() < 3e-4
    first = int(np.argmin(np.abs(motion.t - recording.t[0])))
    true = dq[first : first + len(recording), 0]
    near = _beside_reversals(true)
    counted = near[~recording.sign_unknown[near, 0]]
    error = np.abs(recording.dq[counted, 0] - true[counted])
    allowed = np.maximum(np.abs(true[counted]) / 8, ALIKE * np.abs(recording.ddq[counted, 0]) * STEP)
    assert np.sum(error > allowed) <= 0.01 * len(counted)
    assert len(counted) > 0 or friction > 0.0 or counts < 2**18

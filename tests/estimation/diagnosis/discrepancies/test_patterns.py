"""Tests of torques outside the catalogue: they are described by what they depend on, not by a wrong name."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.signal import lfilter

from estimation import diagnose
from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.recordings.log_reading import build_recording
from robots.plants import simulate
from robots.robot import Robot
from robots.signals import Log, Motion
from robots.terms.discrepancies.patterns import build_pattern


def _swing(motion: Motion, size: float, tau: np.ndarray) -> np.ndarray:
    return size * np.sin(2 * np.pi * 0.27 * np.asarray(motion.t) + 1.0)


def _bend(motion: Motion, size: float, tau: np.ndarray) -> np.ndarray:
    ddq = np.asarray(motion.ddq)[:, 1]
    return size * (ddq / np.abs(ddq).max()) ** 3


def _rub(motion: Motion, size: float, tau: np.ndarray) -> np.ndarray:
    return size * np.sin(2 * np.pi * 1.13 * np.asarray(motion.t)) * np.sign(np.asarray(motion.dq)[:, 1])


def _catch(motion: Motion, size: float, tau: np.ndarray) -> np.ndarray:
    return size * np.exp(-0.5 * ((np.asarray(motion.q)[:, 1] - 0.2) / 0.05) ** 2)


def _grind(motion: Motion, size: float, tau: np.ndarray) -> np.ndarray:
    return _catch(motion, size, tau) * np.sign(np.asarray(motion.dq)[:, 1])


def _creep(motion: Motion, size: float, tau: np.ndarray) -> np.ndarray:
    step = float(motion.t[1] - motion.t[0])
    slow = lfilter([step / 5.0], [1.0, step / 5.0 - 1.0], tau[:, 1])
    return size * slow / slow.std()


def _sag(motion: Motion, size: float, tau: np.ndarray) -> np.ndarray:
    step = float(motion.t[1] - motion.t[0])
    power = lfilter([step / 0.3], [1.0, step / 0.3 - 1.0], (tau * motion.dq).sum(axis=1))
    return size * tau[:, 1] / tau[:, 1].std() * np.tanh(power / power.std())


def _push(motion: Motion, size: float, tau: np.ndarray) -> np.ndarray:
    ddq = np.asarray(motion.ddq)[:, 0]
    return size * ddq / ddq.std() * np.sin(np.asarray(motion.q)[:, 1])


def _leak(motion: Motion, size: float, tau: np.ndarray) -> np.ndarray:
    t = np.asarray(motion.t)
    return 3 * size * np.exp(-t / 10.0) * np.cos(np.asarray(motion.q)[:, 1])


def _buffer(motion: Motion, size: float, tau: np.ndarray) -> np.ndarray:
    q = np.asarray(motion.q)[:, 1]
    return 6 * size * np.maximum(q - np.quantile(q, 0.8), 0.0) / np.ptp(q)


def _lag_of_gauge(motion: Motion, size: float, tau: np.ndarray) -> np.ndarray:
    """Computes the error of a torque sensor with hysteresis (Prandtl's play operator)."""
    width, shown, inside = 0.4 * tau[:, 1].std(), [], float(tau[0, 1])
    for value in tau[:, 1]:
        inside = min(max(inside, value - width), value + width)
        shown.append((inside - value) / width)
    return size * np.array(shown)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("stranger", "share", "pattern"),
    [
        pytest.param(_catch, 0.2, "pattern:spot:0:even", marks=pytest.mark.longer),
        pytest.param(_grind, 0.2, "pattern:spot:0:odd", marks=pytest.mark.longer),
        (_swing, 0.1, "pattern:sway:0:even"),
        pytest.param(_rub, 0.1, "pattern:sway:0:odd", marks=pytest.mark.longer),
        (_bend, 0.2, "pattern:acceleration:0:even"),
        pytest.param(_creep, 0.1, "pattern:creep:0:even", marks=pytest.mark.longer),
        pytest.param(_sag, 0.1, "pattern:supply:0:even", marks=pytest.mark.longer),
        pytest.param(_push, 0.1, "pattern:push:1:even", marks=pytest.mark.longer),
        pytest.param(_leak, 0.2, "pattern:ageing:0:even", marks=pytest.mark.longer),
        pytest.param(_buffer, 0.2, "pattern:stop:0:above", marks=pytest.mark.longer),
        pytest.param(_lag_of_gauge, 0.1, "pattern:hysteresis:0:even", marks=pytest.mark.longer),
    ],
)
def test_a_stranger_is_told_by_what_it_depends_on(
    stranger: Callable[[Motion, float, np.ndarray], np.ndarray],
    share: float,
    pattern: str,
    arm: Robot,
    arm_plant: Callable,
    fourier_motion: Callable,
) -> None:
    """Each torque outside the catalogue is unexplained, with the right joint and the right pattern."""
    motion = fourier_motion(arm, duration=30.0)
    log = simulate(arm_plant(torque_noise=0.02), motion, seed=0)
    assert log.tau is not None
    size = share * np.sqrt(np.mean(log.tau[:, 1] ** 2))
    tau = log.tau + np.column_stack([np.zeros(len(log.t)), stranger(motion, size, log.tau)])
    result = diagnose(arm, replace(log, tau=tau))
    assert result.verdict == "unexplained"
    assert (result.findings[0].joint, result.findings[0].pattern) == (2, pattern)
    if "spot" in pattern:
        values = {parameter.name: parameter.value for parameter in result.findings[0].parameters}
        assert values["centre"] == pytest.approx(0.2, abs=0.02)
        assert values["width"] == pytest.approx(0.05, rel=0.3)
        assert values["peak"] == pytest.approx(size, rel=0.3)
    if "stop" in pattern:
        place = {parameter.name: parameter.value for parameter in result.findings[0].parameters}["place"]
        assert place == pytest.approx(np.quantile(np.asarray(motion.q)[:, 1], 0.8), abs=0.05)
    if "sway" in pattern:
        values = {parameter.name: parameter.value for parameter in result.findings[0].parameters}
        assert values["frequency"] == pytest.approx(1.13 if "odd" in pattern else 0.27, abs=0.01)


@pytest.mark.slow
def test_a_line_is_proposed_at_its_top(
    arm: Robot, arm_log: Callable[..., Log], pose_arm: Callable[..., Problem]
) -> None:
    """A spectral line is proposed to a fiftieth of the log's resolution.

    A search that starts half a resolution from the line would leave as much of it as it explains.
    """
    recording = build_recording(arm, [arm_log(torque_noise=0.02)])
    problem = pose_arm(recording)
    vibration = build_pattern("pattern:vibration:0:even")
    assert vibration is not None
    for frequency in (3.1234, 7.0071, 11.0):
        residual = np.random.default_rng(0).normal(size=recording.tau.shape)
        residual[:, 0] += np.sin(2 * np.pi * frequency * recording.t + 0.4)
        ((first,), *_) = vibration.propose(problem.situation, 1, residual, 4)
        assert abs(first - frequency) < 0.02 / recording.duration


@pytest.mark.longer
def test_what_a_joint_feels_when_it_goes_is_told(arm: Robot, arm_plant: Callable) -> None:
    """A brake that opens late, and drags in the first 0.25 s of each move, gives the pattern of a standstill."""
    step, moves = 0.004, 16
    rise = np.concatenate([np.zeros(150), 0.5 - 0.5 * np.cos(np.pi * np.arange(350) / 350), np.ones(100)])
    way = np.concatenate([[0.0], np.cumsum(np.tile([1.0, -0.6, -1.0, 0.6], moves // 4))])
    turn = np.concatenate([a + (b - a) * rise for a, b in pairwise(way)])
    t = step * np.arange(len(turn))
    q = np.column_stack([0.8 * np.roll(turn, 300), turn])
    q[:300, 0] = 0.0
    dq = np.gradient(q, step, axis=0)
    motion = Motion(t=t, q=q, dq=dq, ddq=np.gradient(dq, step, axis=0))
    log = simulate(arm_plant(torque_noise=0.02), motion, seed=0)
    since = np.tile(np.arange(600) - 150, moves) * step
    drag = 0.2 * np.sqrt(np.mean(log.tau[:, 1] ** 2)) * np.sign(dq[:, 1]) * ((since >= 0) & (since < 0.25))
    result = diagnose(arm, replace(log, tau=log.tau + np.column_stack([np.zeros(len(t)), drag])))
    assert result.verdict == "unexplained"
    assert (result.findings[0].joint, result.findings[0].pattern) == (2, "pattern:start:0:odd")
    assert result.findings[0].gain.ci95[0] > 0

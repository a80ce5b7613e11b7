"""Torques that no effect makes: told by what they depend on, not forced into a name."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from estimation import diagnose
from estimation.diagnosis.patterns import build_pattern
from estimation.diagnosis.problem import Problem
from estimation.diagnosis.states import record
from robots.plants import simulate
from robots.robot import Robot
from robots.signals import Log, Motion


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


@pytest.mark.parametrize(
    ("stranger", "share", "pattern"),
    [
        (_catch, 0.2, "pattern:spot:0:even"),
        (_grind, 0.2, "pattern:spot:0:odd"),
        (_swing, 0.1, "pattern:sway:0:even"),
        (_rub, 0.1, "pattern:sway:0:odd"),
        (_bend, 0.2, "pattern:acceleration:0:even"),
        (_creep, 0.1, "pattern:creep:0:even"),
        (_sag, 0.1, "pattern:supply:0:even"),
        (_push, 0.1, "pattern:push:1:even"),
        (_leak, 0.2, "pattern:ageing:0:even"),
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
    """A torque that swings by itself is no drift, one that grows with the cube of the acceleration no spring.

    A tooth that catches is neither a spring nor a ripple, nor both.
    """
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
    if "sway" in pattern:
        values = {parameter.name: parameter.value for parameter in result.findings[0].parameters}
        assert values["frequency"] == pytest.approx(1.13 if "odd" in pattern else 0.27, abs=0.01)


def test_a_line_is_proposed_at_its_top(
    arm: Robot, arm_log: Callable[..., Log], pose_arm: Callable[..., Problem]
) -> None:
    """To a fiftieth of what the log resolves: from half of that beside it, a search would leave as much as it takes."""
    recording = record(arm, [arm_log(torque_noise=0.02)])
    problem = pose_arm(recording)
    vibration = build_pattern("pattern:vibration:0:even")
    assert vibration is not None
    for frequency in (3.1234, 7.0071, 11.0):
        residual = np.random.default_rng(0).normal(size=recording.tau.shape)
        residual[:, 0] += np.sin(2 * np.pi * frequency * recording.t + 0.4)
        ((first,), *_) = vibration.propose(problem.situation, 1, residual, 4)
        assert abs(first - frequency) < 0.02 / recording.duration

"""Tests of logs in which a joint rests except for encoder flicker."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from estimation.diagnosis import diagnose
from estimation.diagnosis.recordings.log_reading import build_recording
from estimation.diagnosis.results.diagnosis import Diagnosis
from estimation.gate import check_log
from robots.plants import simulate
from robots.robot import Robot
from robots.signals import Log, Motion

COUNT = 2 * np.pi / 2**17


@pytest.fixture(scope="module")
def alone(arm: Robot, arm_plant: Callable, fourier_motion: Callable) -> Callable[..., Log]:
    """Returns a log in which one joint moves; the other flickers by a count while friction holds any torque."""

    def build(moving: int, later: float, step: float = 0.0) -> Log:
        motion = fourier_motion(arm, 1)
        still = np.array([1.0, 0.0]) if moving == 0 else np.array([0.0, 1.0])
        motion = Motion(motion.t + later, *(getattr(motion, name) * still for name in ("q", "dq", "ddq")))
        log = simulate(arm_plant(torque_noise=0.02), motion, seed=3 + moving)
        q, tau = np.array(log.q), np.array(log.tau)
        stuck, t = 1 - moving, np.asarray(log.t)
        q[:, stuck] = COUNT * np.round(0.7 * np.sin(2 * np.pi * 0.37 * t) * np.sin(2 * np.pi * 0.05 * t))
        tau[:, stuck] += 2.0 * np.sin(2 * np.pi * 0.11 * t) + 1.5
        tau[:, moving] += step * np.sign(motion.dq[:, moving]) * (t > t[0] + 8.0)
        return replace(log, q=q, tau=tau)

    return build


@pytest.mark.slow
@pytest.mark.parametrize("flicker", [False, True])
def test_a_joint_that_never_moves_is_told(arm: Robot, alone: Callable[..., Log], flicker: bool, tmp_path: Path) -> None:
    """A joint that never moves gives a note, and the result can be saved."""
    log = alone(0, 0.0)
    q = np.array(log.q)
    q[:, 1] = 0.3 + 1e-5 * flicker * (np.random.default_rng(0).random(len(q)) < 0.3)
    found = diagnose(arm, replace(log, q=q), candidates=("stribeck",))
    assert found.verdict == "none", found.summary()
    assert any("Joint 2 hardly moved: its friction" in note for note in found.notes)
    found.save(tmp_path)
    assert np.isfinite(Diagnosis.load(tmp_path).baseline[0])


@pytest.mark.slow
def test_a_joint_that_trembles_by_a_count_is_at_rest(arm: Robot, arm_log: Callable, alone: Callable[..., Log]) -> None:
    """A joint that flickers by a count has no known sign, and its noise is that of the log in which it moves."""
    both = arm_log(torque_noise=0.02)
    first = build_recording(arm, [both])
    recording = build_recording(arm, [both, alone(0, 100.0)])
    second = recording.runs[1]
    assert recording.sign_unknown[second, 1].all()
    assert recording.sign_unknown[second, 0].mean() < 0.3
    assert not recording.sign_known_from_velocity[second, 1].any()
    assert recording.floor[1] == pytest.approx(first.floor[1])
    assert recording.reversal_acceleration_error[1] == pytest.approx(first.reversal_acceleration_error[1])


@pytest.mark.slow
def test_an_unseen_log_of_one_joint_is_judged_by_that(arm: Robot, arm_log: Callable, alone: Callable[..., Log]) -> None:
    """In a held-out log of one joint, the resting joint has no error."""
    found = diagnose(arm, arm_log(torque_noise=0.02), held_out=alone(0, 100.0), candidates=("stribeck",))
    recording = build_recording(arm, [alone(0, 100.0)], travel=np.array([1.0, 1.0]))
    assert recording.sign_unknown[:, 1].all()
    assert found.baseline[0] < 0.05
    assert np.isnan(found.baseline[1])  # its error is unknown


def test_the_gate_asks_nothing_of_a_joint_that_stands(arm: Robot, alone: Callable[..., Log]) -> None:
    """The log check reports a resting joint only as hardly moving."""
    report = check_log(arm, alone(0, 0.0))
    own = {finding.name for finding in report.findings if finding.joint == 2}
    assert own <= {"hardly_moves", "quantised_position"}
    assert "hardly_moves" in own
    assert not [finding for finding in report.findings if finding.severity == "refuse"]


@pytest.mark.slow
def test_single_joint_logs_beside_another_find_nothing_that_is_not_there(
    arm: Robot, arm_log: Callable, alone: Callable[..., Log]
) -> None:
    """Static friction torque in single-joint logs is no effect and no error (false alarm: 1 in 100)."""
    logs = [arm_log(torque_noise=0.02), alone(0, 100.0), alone(1, 200.0)]
    found = diagnose(arm, logs)
    assert found.verdict == "none", found.summary()
    assert np.max(found.baseline) < 0.05


@pytest.mark.slow
def test_what_one_joint_alone_shows_is_found(arm: Robot, alone: Callable[..., Log]) -> None:
    """From logs of one moving joint each, a friction step is found, and stretches of its log measure the gain."""
    candidates = ("friction_step", "thermal_friction", "external_contact", "stribeck", "torque_sensor_drift")
    found = diagnose(arm, [alone(0, 100.0, step=0.6), alone(1, 200.0)], candidates=candidates)
    assert [(finding.effect, finding.joint) for finding in found.findings] == [("friction_step", 1)]
    assert "a joint moves in one log only" in found.how_unseen or "acts in one log only" in found.how_unseen
    assert found.extended[0] < 0.8 * found.baseline[0]


@pytest.mark.slow
def test_limits_say_that_a_push_in_a_rest_is_not_seen(arm: Robot, arm_log: Callable) -> None:
    """Limits of transient effects have a note if the arm rests for some time."""
    log = arm_log(torque_noise=0.02)
    halves = np.linspace(0.0, len(log.t) - 1.0, len(log.t))
    # Three seconds of rest in the middle of the motion.
    at = np.clip(np.where(halves < len(log.t) / 2, halves, np.maximum(halves - 750, len(log.t) / 2)), 0, None).astype(
        int
    )
    stopped = replace(log, q=log.q[at], tau=log.tau[at], dq=None, ddq=None)
    for logs, rests in ((log, False), (stopped, True)):
        limits = diagnose(arm, logs, candidates=("external_contact", "stribeck"), check=False).limits
        told = {limit.effect for limit in limits if "at rest" in limit.note}
        assert told == ({"external_contact"} if rests else set())

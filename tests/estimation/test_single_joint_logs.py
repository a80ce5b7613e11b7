"""Logs of one joint's motion, the others held by friction: they add what they show, and nothing else."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from estimation import identify, predict
from estimation.regressions.preparation import prepare_all, still_joints
from robots.plants import simulate
from robots.robot import Robot
from robots.signals import Log, Motion

COUNT = 2 * np.pi / 2**17


@pytest.fixture(scope="module")
def alone(arm_plant: Callable, fourier_motion: Callable) -> Callable[[int], Log]:
    """A log of one joint's motion; the other trembles by a count, and friction takes up to 1.5 N m of its torque."""

    def build(moving: int) -> Log:
        plant = arm_plant(torque_noise=0.02)
        motion = fourier_motion(plant.robot, 3)
        alike = np.arange(2) == moving
        motion = Motion(motion.t + 100.0 * (1 + moving), *(getattr(motion, x) * alike for x in ("q", "dq", "ddq")))
        log = simulate(plant, motion, seed=5 + moving)
        t, q, tau = np.asarray(log.t), np.array(log.q), np.array(log.tau)
        q[:, 1 - moving] = COUNT * np.round(0.7 * np.sin(2 * np.pi * 0.37 * t))
        tau[:, 1 - moving] += 0.9 * np.sin(2 * np.pi * 0.11 * t) + 0.6
        return replace(log, q=q, tau=tau)

    return build


def _errors(arm: Robot, logs: list[Log], arm_plant: Callable, fourier_motion: Callable) -> np.ndarray:
    """Error of the torque of another motion over its size, without noise (2,)."""
    model = identify(arm, logs, friction="coulomb-viscous").model
    unseen = simulate(arm_plant(), fourier_motion(arm, 8), seed=9)
    predicted = predict(model, unseen).predicted
    return np.asarray(np.sqrt(np.mean((predicted - unseen.tau) ** 2, axis=0) / np.mean(unseen.tau**2, axis=0)))


def test_joints_that_stand_are_reported_by_their_range(
    arm_log: Callable[..., Log], alone: Callable[[int], Log]
) -> None:
    """Below 3e-4 of that in another log; a joint that stands in all of them is like one that moves."""
    logs = [arm_log(), alone(0), alone(1)]
    np.testing.assert_array_equal(still_joints([log.q for log in logs]), [[0, 0], [0, 1], [1, 0]])
    assert not still_joints([logs[1].q]).any()
    assert not still_joints([np.zeros((9, 2)), np.zeros((5, 2))]).any()


def test_their_rows_do_not_count_beside_a_log_of_all_joints(
    arm: Robot, arm_log: Callable[..., Log], alone: Callable[[int], Log]
) -> None:
    """And its encoder's steps are no motion; without such a log their rows show what joints feel of each other."""
    whole, own = (part.rows(10.0) for part in prepare_all(arm, [arm_log(), alone(0)]))
    assert whole.rest is None or not whole.rest.all(axis=0).any()
    assert not own.mask[:, 1].any()
    assert own.mask[:, 0].mean() > 0.9
    assert not own.motion.dq[:, 1].any()
    assert not own.motion.ddq[:, 1].any()
    only = prepare_all(arm, [alone(0), alone(1)])[0].rows(10.0)
    assert only.mask[:, 1].all()
    assert not only.motion.ddq[:, 1].any()


@pytest.mark.slow
def test_they_make_no_estimate_worse(
    arm: Robot, arm_log: Callable[..., Log], alone: Callable[[int], Log], arm_plant: Callable, fourier_motion: Callable
) -> None:
    """Torque that friction holds is a tenth of the moving joint's: as rows that count it would cost per cents."""
    first = arm_log(torque_noise=0.02)
    before = _errors(arm, [first], arm_plant, fourier_motion)
    after = _errors(arm, [first, alone(0), alone(1)], arm_plant, fourier_motion)
    assert np.all(after < 1.3 * before)
    assert np.all(after < 0.03)


@pytest.mark.slow
def test_the_errors_that_are_stated_are_those_of_joints_that_move(
    arm: Robot, arm_log: Callable[..., Log], alone: Callable[[int], Log]
) -> None:
    """The band of 95 % and the error of left-out blocks know nothing of the torque that friction holds."""
    logs = [arm_log(torque_noise=0.02), alone(0), alone(1)]
    one, all_ = (identify(arm, some, friction="coulomb-viscous").model.provenance for some in (logs[:1], logs))
    assert np.all(np.asarray(all_["band95"]) < 1.5 * np.asarray(one["band95"]))
    assert np.all(np.asarray(all_["held_out_rms"]) < 1.5 * np.asarray(one["held_out_rms"]))

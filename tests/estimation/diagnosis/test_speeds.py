"""What is at one speed alone is no ripple, and where an encoder's steps make lines nothing fast is looked for."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from estimation.diagnosis.hypotheses import Hypothesis
from estimation.diagnosis.problem import Group, Problem
from estimation.diagnosis.recording import CRUISE, Recording
from estimation.diagnosis.scoring import accept
from estimation.diagnosis.speeds import RANGES, scatter_over_speeds
from estimation.diagnosis.states import record
from estimation.diagnosis.upper import WIDER
from robots.robot import Robot
from robots.signals import Log
from robots.terms.effects import EFFECTS

RIPPLE = Hypothesis(EFFECTS["torque_ripple"], 2)
SHAPE = (40.0, 0.0)


@pytest.fixture(scope="module")
def recording(arm: Robot, arm_log: Callable[..., Log]) -> Recording:
    """A log of the arm without effects."""
    return replace(record(arm, [arm_log(torque_noise=0.02)]), floor=np.full(2, 1e-11), cycles=(None,))


@pytest.fixture(scope="module")
def problem(recording: Recording, pose_arm: Callable[..., Problem]) -> Problem:
    """The same, white, with the frequencies above its bands."""
    return pose_arm(recording, wider=WIDER)


def _scatter(problem: Problem, group: Group, size: float, slow: float, fast: float) -> float:
    """Of a ripple that has so many times its size at slow and at fast motion, in noise of the problem's own."""
    assert problem.upper is not None
    above = problem.upper.joints[1]
    assert above is not None
    coefficients = np.zeros(group.size)
    coefficients[0] = size / np.sqrt(group.gram[0, 0])
    speeds = [np.abs(problem.recording.dq[:: w.stride, 1]) for w in (problem.whitening, problem.upper.whitening)]
    torques = [X @ coefficients for X in (group.columns[0], group.above[0])]
    energy = np.concatenate([torque**2 for torque in torques])
    order = np.argsort(np.concatenate(speeds))
    middle = np.concatenate(speeds)[order][np.searchsorted(np.cumsum(energy[order]), energy.sum() / 2)]
    factors = [np.where(speed < middle, slow, fast) for speed in speeds]
    residual = problem.residual.copy()
    residual[:, 1] += problem.whitening.precision[1, 1] * factors[0] * torques[0]
    joints = (None, replace(above, residual=above.residual + factors[1] * torques[1]))
    changed = replace(problem, residual=residual, upper=replace(problem.upper, joints=joints))
    return scatter_over_speeds(changed, group, coefficients, accept(changed, ()))


def test_a_ripple_at_all_speeds_counts_whole_and_a_line_at_one_does_not(problem: Problem) -> None:
    """Nor does one that a position loop yields to lose much; by noise alone a ratio of 2 is passed 1 time in 9."""
    group = problem.measured(RIPPLE, SHAPE)
    assert group.above
    for size in (8.0, 30.0):
        assert _scatter(problem, group, size, 1.0, 1.0) < 1.5
        assert _scatter(problem, group, size, 1.25, 0.75) < 1.6
    assert _scatter(problem, group, 8.0, 2.0, -0.2) > 3.0
    assert _scatter(problem, group, 8.0, -0.2, 2.0) > 3.0
    assert RANGES >= 2


def test_a_ripple_that_is_not_there_is_not_judged(problem: Problem) -> None:
    """No energy, or none explained: the ratio is one."""
    group = problem.measured(RIPPLE, SHAPE)
    assert scatter_over_speeds(problem, group, np.zeros(group.size), accept(problem, ())) == 1.0
    assert _scatter(problem, group, 8.0, -1.0, -1.0) == 1.0


def test_constant_speed_is_told_by_the_encoder(recording: Recording) -> None:
    """A ramp cruises but where it begins, over two seconds; a slow sine does not, nor does anything without steps."""
    t, count = recording.t - recording.t[0], 5e-5
    ramp = np.where(t < 2.0, 0.025 * t**2, 0.1 * (t - 1.0))
    turning = replace(recording, q=np.column_stack([ramp, np.sin(0.6 * t)]), counts=np.full(2, count))
    cruises = turning.cruising(0)
    assert cruises[t > 2.05].all()
    assert not cruises[t < 2.0 - CRUISE].any()
    assert turning.cruising(1).mean() < 0.05
    assert not replace(turning, counts=np.zeros(2)).cruising(0).any()
    assert not replace(turning, counts=None).cruising(0).any()


def test_above_the_bands_rows_at_constant_speed_do_not_count(
    recording: Recording, pose_arm: Callable[..., Problem]
) -> None:
    """An encoder so coarse that a third of the motion is at constant speed by it: those rows weigh nothing."""
    coarse = replace(recording, counts=np.full(2, 0.1))
    upper = pose_arm(coarse, wider=WIDER).upper
    assert upper is not None
    above = upper.joints[1]
    assert above is not None
    cruises = coarse.cruising(1)[:: upper.whitening.stride]
    assert 0.05 < cruises.mean() < 0.95
    assert not above.counts[cruises].any()
    assert above.counts[~cruises].any()

"""Where an encoder's steps make lines, at constant speed, nothing fast is looked for."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from estimation.diagnosis.problem import Problem
from estimation.diagnosis.recording import CRUISE, Recording
from estimation.diagnosis.states import record
from estimation.diagnosis.upper import WIDER
from robots.robot import Robot
from robots.signals import Log


@pytest.fixture(scope="module")
def recording(arm: Robot, arm_log: Callable[..., Log]) -> Recording:
    """A log of the arm without effects."""
    return replace(record(arm, [arm_log(torque_noise=0.02)]), floor=np.full(2, 1e-11), cycles=(None,))


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

"""What the choice of the cut-off changes in the model's torque."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.signal import butter, sosfiltfilt

from estimation.diagnosis.base_models.payload_and_gravity import base_torque
from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.joint_fits.cutoff_errors import ENDS, NEIGHBOUR, cutoff_change
from estimation.diagnosis.recordings.log_reading import build_recording
from robots.robot import Robot
from robots.signals import Log

CHOSEN = 1.0  # [Hz], within the motion's own band


def test_the_change_is_that_of_a_lower_cutoff(
    arm: Robot, arm_log: Callable[..., Log], pose_arm: Callable[..., Problem]
) -> None:
    """The change is the torque of positions that scipy filters lower, minus that of the recording's; none at rest."""
    recording = build_recording(arm, [arm_log(torque_noise=0.02)])
    cutoffs = np.full((1, arm.n), CHOSEN)
    recording = replace(recording, cutoffs=cutoffs, cycles=(None,))
    problem = pose_arm(recording)
    problem = replace(problem, recording=recording)
    values = problem.parameters_without_payload[list(problem.baseline.base.independent)]
    found = cutoff_change(problem, values)
    section = butter(8, NEIGHBOUR * CHOSEN, fs=1.0 / recording.step, output="sos")
    q = sosfiltfilt(section, recording.q, axis=0)
    dq = np.gradient(q, recording.step, axis=0)
    ddq = np.gradient(dq, recording.step, axis=0)
    other = replace(recording, q=q, dq=dq, ddq=ddq)
    wanted = base_torque(problem.baseline.base, other, values) - base_torque(problem.baseline.base, recording, values)
    edge = 10 + int(ENDS / (NEIGHBOUR * CHOSEN * recording.step))
    inner = slice(edge, -edge)
    counts = ~recording.sign_unknown[inner]
    # Numerical derivatives differ by some per cent; a reversal may move by a row.
    error = (found[inner] - wanted[inner]) * counts
    assert np.sqrt(np.mean(error**2)) < 0.2 * np.sqrt(np.mean(wanted[inner] ** 2))
    assert np.abs(found[inner]).max() > 0
    assert not cutoff_change(replace(problem, recording=replace(recording, cutoffs=None)), values).any()

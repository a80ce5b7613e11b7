"""Logs that no base model explains: of several, such a one would spoil what the others tell."""

from __future__ import annotations

import numpy as np

from estimation.diagnosis.calibration import MAX_UNEXPLAINED_POWER
from estimation.diagnosis.recordings.recording import Recording
from robots.base_parameters import BaseParameters

# Rows of a log that are looked at, and how many numbers determine a parameter.
ROWS, ENOUGH = 2000, 3


def find_unusable_logs(base: BaseParameters, recording: Recording) -> dict[int, float]:
    """Finds logs of which the base model explains next to nothing, whatever its parameters.

    Friction of all kinds, masses and offsets are fitted to the log alone: a drive that rings in saturation, a torque
    that is not this robot's. Beside others, it would bend the base model by which effects are sought in those.

    Args:
        base: the base model.
        recording: of several logs.

    Returns:
        By number of the log, in the order of time and from 0: the share of the torque's RMS that is left, on the joint
        where it is least. Empty where all logs are so, or there is one alone.
    """
    if len(recording.runs) < 2:
        return {}
    left: dict[int, float] = {}
    for k, (run, gravity) in enumerate(zip(recording.runs, recording.gravities, strict=True)):
        rows = slice(run.start, run.stop, max(1, (run.stop - run.start) // ROWS))
        motion = recording.q[rows], recording.dq[rows], recording.ddq[rows]
        counts = ~recording.sign_unknown[rows]
        Y = base.regressor(*motion, gravity=gravity) * counts[:, :, None]
        tau = recording.tau[rows] * counts
        squares = (tau**2).sum(axis=0)
        acts = squares > 0
        if counts.sum() < ENOUGH * base.size or not acts.any():
            continue
        # Joints count alike, however large their torques are.
        weights = np.where(acts, 1.0 / np.sqrt(np.where(acts, squares, 1.0)), 0.0)
        A, y = (Y * weights[:, None]).reshape(-1, Y.shape[2]), (tau * weights).reshape(-1)
        errors = (y - A @ np.linalg.lstsq(A, y, rcond=None)[0]).reshape(tau.shape)
        share = float((errors**2).sum(axis=0)[acts].min())
        if share > MAX_UNEXPLAINED_POWER:
            left[k] = float(np.sqrt(share))
    return left if len(left) < len(recording.runs) else {}

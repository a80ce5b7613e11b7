"""Logs that no base model explains; they would distort the fit to the other logs."""

from __future__ import annotations

import numpy as np

from estimation.diagnosis.calibration import MAX_UNEXPLAINED_POWER
from estimation.diagnosis.recordings.recording import Recording
from robots.base_parameters import BaseParameters

# Rows of each log that are used, and values that must count per base parameter.
ROWS, ENOUGH = 2000, 3


def find_unusable_logs(base: BaseParameters, recording: Recording) -> dict[int, float]:
    """Finds logs that the base model hardly explains, whatever its parameters.

    The base model, with friction, masses and offsets, is fitted to each log alone. Examples are a drive that rings in
    saturation, or torque of another robot. Such a log would distort the base model with which effects are searched in
    the others.

    Args:
        base: the base model.
        recording: a recording of several logs.

    Returns:
        By index of the log, in the order of time and from 0: the share of the torque's RMS that remains, on the joint
        where it is least. Empty if this holds for all logs, or if there is one log only.
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
        # Joints count alike, whatever the size of their torques.
        weights = np.where(acts, 1.0 / np.sqrt(np.where(acts, squares, 1.0)), 0.0)
        A, y = (Y * weights[:, None]).reshape(-1, Y.shape[2]), (tau * weights).reshape(-1)
        errors = (y - A @ np.linalg.lstsq(A, y, rcond=None)[0]).reshape(tau.shape)
        share = float((errors**2).sum(axis=0)[acts].min())
        if share > MAX_UNEXPLAINED_POWER:
            left[k] = float(np.sqrt(share))
    return left if len(left) < len(recording.runs) else {}

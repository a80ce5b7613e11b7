"""Logs that no base model explains, and logs that do not determine its parameters."""

from __future__ import annotations

import numpy as np

from estimation.diagnosis.calibration import MAX_UNEXPLAINED_POWER
from estimation.diagnosis.recordings.recording import Recording
from estimation.linear_algebra.orthonormal import orthonormal
from estimation.uncertainty.correlations import effective_rows
from robots.base_parameters import BaseParameters
from robots.common.errors import InputError

# Rows of each log that are used, and values that must count per base parameter.
ROWS, ENOUGH = 2000, 3
# Independent values of torque per parameter below which the parameters only follow the noise. They are counted within
# windows [s]: slower errors are those of the model, which more rows of the same motion do not reduce.
INDEPENDENT, WINDOW = 2.0, 1.0
# Directions of the scaled regressor below this share of the largest are not determined by the log.
FAINT = 1e-7


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


def require_information(base: BaseParameters, recording: Recording) -> None:
    """Refuses logs whose torque holds too few independent values for the parameters that their motion excites.

    The limit is neither a number of rows nor a duration: noise may be correlated over many rows.

    Args:
        base: the base model.
        recording: all logs of the fit.

    Raises:
        InputError: stating both numbers.
    """
    known = ~recording.sign_unknown
    weights = known / np.maximum(recording.tau.std(axis=0), 1e-12)
    runs = zip(recording.runs, recording.gravities, strict=True)
    Y = [base.regressor(recording.q[r], recording.dq[r], recording.ddq[r], gravity=gravity) for r, gravity in runs]
    A = (np.concatenate(Y) * weights[:, :, None]).reshape(-1, base.size)
    Q, y = orthonormal(A, FAINT), (recording.tau * weights).reshape(-1)
    left = (y - Q @ (Q.T @ y)).reshape(recording.tau.shape)
    values = 0.0
    for series in (left[known[:, j], j] for j in range(recording.n)):
        windows = np.array_split(series, max(1, round(len(series) * recording.step / WINDOW)))
        values += sum(effective_rows(part) for part in windows if len(part) and np.ptp(part) > 0)
    if values < INDEPENDENT * Q.shape[1]:
        raise InputError(
            f"{recording.duration:.1f} s of usable logs hold about {values:.0f} independent values of torque for "
            f"{Q.shape[1]} parameters",
            file=recording.names[0] if len(recording.names) == 1 else None,
            allowed=f"{INDEPENDENT:g} values per parameter or more",
            remedy="record a longer log, or one with faster and more varied motion",
        )

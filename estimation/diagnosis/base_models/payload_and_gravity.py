"""Known payload and gravity of each log, in the measured torque and in the base model."""

from __future__ import annotations

from dataclasses import replace
from itertools import groupby

import numpy as np

from estimation.diagnosis.recordings.recording import Recording
from estimation.diagnosis.recordings.thinning import decimate, evaluate_at_full_rate
from robots.base_parameters import BaseParameters
from robots.common.arrays import Array
from robots.regressor import TorqueModel, default_model
from robots.robot import Robot
from robots.terms.effects import Situation
from robots.terms.situations.flange_body import with_body
from robots.terms.situations.joining import join_situations
from robots.terms.situations.of_model import sign_of, velocity_scale
from robots.terms.situations.situation import Finer, situation, with_finer


def subtract_known_payload(robot: Robot, recording: Recording) -> Recording:
    """Subtracts the torque of the logs' known payloads from the measured torque."""
    if not recording.payloads:
        return recording
    model = default_model(robot)
    tau = recording.tau.copy()
    for run, body, gravity in zip(recording.runs, recording.bodies, recording.gravities, strict=True):
        if body.any():
            parameters = with_body(model, np.zeros(model.size), body)
            motion = (recording.q[run], recording.dq[run], recording.ddq[run])
            tau[run] -= model.under(gravity).torque(*motion, parameters)
    return replace(
        recording,
        tau=tau,
        full_rate=None if recording.full_rate is None else subtract_known_payload(robot, recording.full_rate),
    )


def base_regressor(base: BaseParameters, recording: Recording) -> Array:
    """Evaluates the base model's columns (N, n, b) on a recording, each log under its own gravity.

    If logs are decimated, friction signs pass the same low-pass as the torque.
    """
    Y = _regressor(base, recording)
    if recording.full_rate is None:
        return Y
    scales = velocity_scale(base.model)
    for i, column in enumerate(base.columns):
        if column.symbol == "f1":
            joint = column.joint - 1
            Y[:, joint, i] = friction_signs(recording, joint, scales[[joint]])[:, 0]
    return Y


def friction_signs(recording: Recording, joint: int, scales: Array) -> Array:
    """Evaluates a joint's friction signs (N, k), for widths (k,) [rad/s or m/s]; a width of 0 is a sharp sign.

    The joint is counted from 0.
    """
    return evaluate_at_full_rate(recording, lambda samples: sign_of(samples.dq[:, joint, None], scales))


def _regressor(base: BaseParameters, recording: Recording) -> Array:
    if not recording.gravity_fields:
        return base.regressor(recording.q, recording.dq, recording.ddq)
    Y = np.empty((len(recording), recording.n, base.size))
    for run, gravity in zip(recording.runs, recording.gravities, strict=True):
        motion = (recording.q[run], recording.dq[run], recording.ddq[run])
        base.model.under(gravity).regressor(*motion, columns=base.independent, out=Y[run])
    return Y


def base_torque(base: BaseParameters, recording: Recording, values: Array) -> Array:
    """Evaluates the base model's torque (N, n) [N m or N] with base parameters (b,), each log under its own gravity."""
    parts = []
    for run, gravity in zip(recording.runs, recording.gravities, strict=True):
        motion = (recording.q[run], recording.dq[run], recording.ddq[run])
        parts.append(base.torque(*motion, values, gravity=gravity))
    return np.concatenate(parts)


def build_situation(
    recording: Recording, model: TorqueModel, parameters: Array, columns: tuple[int, ...] | None = None
) -> Situation:
    """Builds the quantities on which effects may depend, including known payloads and gravity of each log.

    Args:
        recording: the data.
        model: the base model, under the gravity of the robot's description.
        parameters: its standard parameters (p,), or those of `columns`.
        columns: indices of the model's columns to which `parameters` belong; by default all.

    Returns:
        The quantities for all rows; those at the full rate are included if the logs are decimated.
    """
    full = np.zeros(model.size)
    full[slice(None) if columns is None else list(columns)] = parameters
    coarse = _situation(recording, model, full)
    if recording.full_rate is None:
        return coarse
    starts, stride = recording.full_rate.starts, recording.stride
    whole = _situation(recording.full_rate, model, full)
    return with_finer(coarse, Finer(whole, lambda rows: decimate(rows, starts, stride)))


def _situation(recording: Recording, model: TorqueModel, full: Array) -> Situation:
    parts = []
    runs = zip(recording.runs, recording.bodies, recording.gravities, strict=True)
    for _, group in groupby(runs, key=lambda item: (item[1].tobytes(), None if item[2] is None else item[2].tobytes())):
        members = list(group)
        _, body, gravity = members[0]
        rows = slice(members[0][0].start, members[-1][0].stop)
        motion = (recording.t[rows], recording.q[rows], recording.dq[rows], recording.ddq[rows])
        starts = tuple(run.start - rows.start for run, *_ in members)
        parts.append(situation(model.under(gravity), with_body(model, full, body), *motion, starts=starts))
    return join_situations(parts, model)

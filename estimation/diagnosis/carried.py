"""Known payloads of some logs: their torque is taken off, and effects that load drives feel it."""

from __future__ import annotations

from dataclasses import replace
from itertools import groupby

import numpy as np
from numpy.typing import NDArray

from estimation.diagnosis.states import Recording
from robots.regressor import TorqueModel, default_model
from robots.robot import Robot
from robots.terms.effects import Situation
from robots.terms.effects.sensitivities import moved_body
from robots.terms.effects.situation import joined, situation

Array = NDArray[np.float64]


def lightened(robot: Robot, recording: Recording) -> Recording:
    """Takes the torque of the logs' known payloads off the measured one."""
    if not recording.payloads:
        return recording
    model = default_model(robot)
    tau = recording.tau.copy()
    for run, body in zip(recording.runs, recording.bodies, strict=True):
        if body.any():
            parameters = with_body(model, np.zeros(model.size), body)
            tau[run] -= model.torque(recording.q[run], recording.dq[run], recording.ddq[run], parameters)
    return replace(recording, tau=tau)


def situation_on(
    recording: Recording, model: TorqueModel, parameters: Array, columns: tuple[int, ...] | None = None
) -> Situation:
    """Gives what effects may depend on in a recording, payloads included.

    Args:
        recording: the data.
        model: the base model.
        parameters: its standard parameters (p,), or those of `columns`.
        columns: the model's columns that `parameters` are of; by default all.
    """
    full = np.zeros(model.size)
    full[slice(None) if columns is None else list(columns)] = parameters
    parts = []
    runs = zip(recording.runs, recording.bodies, strict=True)
    for _, group in groupby(runs, key=lambda item: item[1].tobytes()):
        members = list(group)
        rows = slice(members[0][0].start, members[-1][0].stop)
        motion = (recording.t[rows], recording.q[rows], recording.dq[rows], recording.ddq[rows])
        starts = tuple(run.start - rows.start for run, _ in members)
        parts.append(situation(model, with_body(model, full, members[0][1]), *motion, starts=starts))
    return joined(parts)


def with_body(model: TorqueModel, parameters: Array, body: Array) -> Array:
    """Adds a body at the flange (10,), in its frame, to a model's standard parameters (p,)."""
    result = np.array(parameters)
    if body.any():
        last = [i for i, column in enumerate(model.columns) if column.term == "rigid_body"][-10:]
        result[last] += moved_body(model.robot.chain.tip) @ body
    return result


def point_mass(mass: float, centre: tuple[float, float, float]) -> Array:
    """Gives the ten inertial parameters of a point mass [kg] at a place [m] in the flange's frame."""
    x, y, z = centre
    inertia = (y * y + z * z, -x * y, -x * z, x * x + z * z, -y * z, x * x + y * y)
    return mass * np.array([1.0, x, y, z, *inertia])


__all__ = ["lightened", "point_mass", "situation_on", "with_body"]

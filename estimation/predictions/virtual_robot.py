"""A virtual robot that obeys an identified model, extensions included."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimation.models.model import Model
from robots.common.errors import InputError
from robots.plants import Plant, Sensors
from robots.robot import Robot
from robots.terms.effects import Situation


def virtual_robot(model: Model, robot: Robot | None = None, sensors: Sensors | None = None) -> Plant:
    """Builds the plant that `oed simulate` plays motions on.

    Args:
        model: identified, or extended by a diagnosis.
        robot: whose gears, behind which its encoders are, replace those in the model's file.
        sensors: what the log sees.

    Raises:
        InputError: a robot of another number of joints.
    """
    torque_model = model.torque_model
    if robot is not None:
        if robot.n != model.robot.n:
            raise InputError(f"a model of {model.robot.n} joints", allowed=f"{robot.n}, as {robot.name} has")
        # Its limits may have changed since, but what the model's effects refer to has not.
        torque_model = replace(torque_model, robot=replace(model.robot, gear_ratio=robot.gear_ratio))
    parameters = np.zeros(torque_model.size)
    # Base parameters stand for sums: with the others zero they give the same torques.
    parameters[list(model.columns)] = model.values
    effects = (_Beyond(model),) if model.extensions else ()
    return Plant(model=torque_model, parameters=parameters, sensors=sensors or Sensors(), effects=effects)


@dataclass(frozen=True, eq=False)
class _Beyond:
    """All extensions of a model together."""

    model: Model

    def torque(self, situation: Situation, /) -> NDArray[np.float64]:
        motion = (situation.q, situation.dq, situation.ddq)
        return self.model.torque(*motion, situation.t) - self.model.torque(*motion)

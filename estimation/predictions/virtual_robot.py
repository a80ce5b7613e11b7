"""A virtual robot that obeys an identified model, extensions included."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from estimation.models.model import Model, load_model
from robots.common.errors import InputError
from robots.plants import Plant, Sensors, load_plant, nominal_plant
from robots.robot import Robot
from robots.terms.effects import Situation
from robots.terms.situations.flange_body import with_body


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


def chosen_plant(
    robot: Robot | None,
    *,
    plant: Path | None = None,
    model: Path | None = None,
    body: NDArray[np.float64] | None = None,
) -> tuple[Plant, Robot]:
    """Makes a virtual robot: of a plant file, of an identified model, or of nominal dynamics.

    Args:
        robot: the robot; None for the model's.
        plant: a plant YAML.
        model: a model.json, or its folder, instead of a plant.
        body: ten inertial parameters (10,) of a body on the flange.

    Returns:
        The plant and its robot.

    Raises:
        InputError: neither a robot nor a model, or see `load_plant`, `load_model` and `virtual_robot`.
    """
    if model is not None:
        obeyed = load_model(model)
        made, robot = virtual_robot(obeyed, robot), robot or obeyed.robot
    elif robot is not None:
        made = load_plant(plant, robot) if plant else nominal_plant(robot)
    else:
        raise InputError("no robot to simulate", remedy="name one, or a model")
    if body is not None:
        made = replace(made, parameters=with_body(made.model, np.asarray(made.parameters), body))
    return made, robot


@dataclass(frozen=True, eq=False)
class _Beyond:
    """All extensions of a model together."""

    model: Model

    def torque(self, situation: Situation, /) -> NDArray[np.float64]:
        motion = (situation.q, situation.dq, situation.ddq)
        return self.model.torque(*motion, situation.t) - self.model.torque(*motion)

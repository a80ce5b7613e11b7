"""A plant file: what the virtual robot really is, and how its sensors see it."""

from __future__ import annotations

from os import PathLike
from typing import Literal

from pydantic import Field

from robots.common.config import Config, read_config
from robots.common.errors import InputError
from robots.plants.plant import Plant, nominal_plant
from robots.plants.sensors import Sensors
from robots.robot import Robot


class _Sensors(Config):
    encoder_counts: float = Sensors.encoder_counts
    torque_noise: float = Sensors.torque_noise
    coloured_share: float = Sensors.coloured_share
    correlation_time: float = Sensors.correlation_time
    torque_step: float = Sensors.torque_step


class _Plant(Config):
    friction: Literal["polynomial", "coulomb-viscous"] = "polynomial"
    velocity_scale: float = 1e-3
    spread: float = 0.0
    spread_seed: int = 0
    parameters: dict[str, float] = Field(default_factory=dict)
    sensors: _Sensors = _Sensors()


def load_plant(path: str | PathLike[str], robot: Robot) -> Plant:
    """Reads a plant YAML.

    Keys, all optional: ``friction`` (polynomial, coulomb-viscous) with ``velocity_scale``, ``spread`` (relative
    difference of the truth from the robot's description) with ``spread_seed``, ``parameters`` (standard parameters by
    name, such as ``f1_3: 7.5``), and ``sensors`` (see `Sensors`).

    Raises:
        InputError: a missing file, an unknown key or parameter, a value out of range.
    """
    config = read_config(path, _Plant)
    try:
        return nominal_plant(
            robot,
            friction=config.friction,
            velocity_scale=config.velocity_scale,
            sensors=Sensors(**config.sensors.model_dump()),
            spread=config.spread,
            seed=config.spread_seed,
            overrides=config.parameters,
        )
    except InputError as error:
        raise InputError(
            error.problem, file=path, column=error.column, joint=error.joint, allowed=error.allowed, remedy=error.remedy
        ) from error

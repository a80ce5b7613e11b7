"""A plant file: what the virtual robot really is, and how its sensors see it."""

from __future__ import annotations

from dataclasses import replace
from os import PathLike
from typing import Any, Literal

from pydantic import Field

from robots.common.config import Config, read_config
from robots.common.errors import InputError
from robots.plants.effects import plant_effect
from robots.plants.heat import plant_heat
from robots.plants.plant import Plant, nominal_plant
from robots.plants.sensors import Sensors
from robots.robot import Robot


class _Sensors(Config):
    encoder_counts: float = Sensors.encoder_counts
    torque_noise: float = Sensors.torque_noise
    coloured_share: float = Sensors.coloured_share
    correlation_time: float = Sensors.correlation_time
    torque_step: float = Sensors.torque_step


class _Effect(Config):
    effect: str
    joint: int | None = None
    parameters: dict[str, float]


class _Thermal(Config):
    known: bool = False
    ambient: float = 20.0
    start: float | None = None
    thermometers: Literal["none", "ambient", "all"] = "ambient"
    joints: dict[int, dict[str, Any]] = Field(default_factory=dict)


class _Plant(Config):
    friction: Literal["polynomial", "coulomb-viscous"] = "polynomial"
    velocity_scale: float = 1e-3
    spread: float = 0.0
    spread_seed: int = 0
    parameters: dict[str, float] = Field(default_factory=dict)
    sensors: _Sensors = _Sensors()
    effects: list[_Effect] = Field(default_factory=list)
    thermal: _Thermal | None = None


def load_plant(path: str | PathLike[str], robot: Robot) -> Plant:
    """Reads a plant YAML.

    All keys are optional:

    - ``friction``: polynomial or coulomb-viscous, with ``velocity_scale``;
    - ``spread``: relative difference of the truth from the robot's description, with ``spread_seed``;
    - ``parameters``: standard parameters by name, such as ``f1_3: 7.5``;
    - ``sensors``: see `Sensors`;
    - ``effects``: a list of effects beyond the model, each with ``effect`` (a name of `EFFECTS`), ``joint`` (from 1;
      none for an effect of the whole robot) and ``parameters`` (coefficients and shape parameters by name);
    - ``thermal``: thermal models of the joints, with ``known`` (published models), ``joints`` (model and parameters
      by joint), ``ambient``, ``start`` and ``thermometers``; see `plant_heat`.

    Raises:
        InputError: a missing file, an unknown key or parameter, a value out of range.
    """
    config = read_config(path, _Plant)
    try:
        thermal = config.thermal
        heat = None if thermal is None else plant_heat(robot, **thermal.model_dump())
        if heat is not None and any(e.effect == "thermal_friction" for e in config.effects):
            raise InputError(
                "both thermal and the effect thermal_friction", column="thermal", allowed="only one of them"
            )
        plant = nominal_plant(
            robot,
            friction=config.friction,
            velocity_scale=config.velocity_scale,
            sensors=Sensors(**config.sensors.model_dump()),
            spread=config.spread,
            seed=config.spread_seed,
            overrides=config.parameters,
            effects=tuple(plant_effect(robot, e.effect, e.joint, e.parameters) for e in config.effects),
        )
        return replace(plant, heat=heat)
    except InputError as error:
        raise InputError(
            error.problem, file=path, column=error.column, joint=error.joint, allowed=error.allowed, remedy=error.remedy
        ) from error

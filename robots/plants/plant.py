"""The virtual robot: a torque model with its true parameters, effects beyond it, and the sensors that look at it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from difflib import get_close_matches
from typing import Protocol

import numpy as np

from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.plants.effects import PlantEffect
from robots.plants.heat import PlantHeat, Warmth, heat_piece, reference_friction
from robots.plants.sensors import Sensors
from robots.regressor import TorqueModel, default_model
from robots.robot import Robot
from robots.signals import Log, Motion
from robots.terms.effect_bases.gear_load import ExtraGearLoad, LoadSource
from robots.terms.effects import Situation, situation


class Beyond(Protocol):
    """An effect of a plant beyond its model: a `PlantEffect`, or a finding of a diagnosis."""

    def torque(self, situation: Situation, /) -> Array:
        """Evaluates what it adds to the torque (N, n) [N m or N]."""


@dataclass(frozen=True, kw_only=True)
class Plant:
    """A robot that obeys a torque model exactly, but for the effects that it is given.

    Attributes:
        model: the torque model with p parameters.
        parameters: the truth (p,).
        sensors: what the log sees of it.
        effects: what it has beyond the model.
        heat: of its friction; None where friction does not change.

    Raises:
        InputError: parameters that are not one finite number per column.
    """

    model: TorqueModel
    parameters: Array
    sensors: Sensors = field(default_factory=Sensors)
    effects: tuple[Beyond, ...] = ()
    heat: PlantHeat | None = None

    def __post_init__(self) -> None:
        """Checks the parameters."""
        parameters = np.array(self.parameters, dtype=float)
        if parameters.shape != (self.model.size,):
            raise InputError(f"{parameters.shape} plant parameters", allowed=f"({self.model.size},)")
        if not np.isfinite(parameters).all():
            missing = self.model.columns[int(np.argmin(np.isfinite(parameters)))]
            raise InputError(
                f"the plant has no value for {missing.name}",
                joint=missing.joint,
                remedy="state it in the robot's description or in the plant file",
            )
        parameters.flags.writeable = False
        object.__setattr__(self, "parameters", parameters)

    @property
    def robot(self) -> Robot:
        """The robot."""
        return self.model.robot

    def warmth(self, motion: Motion) -> Warmth | None:
        """Follows the temperatures of a motion that begins cold; None where friction does not change."""
        if self.heat is None:
            return None
        friction = reference_friction(self.model, self.parameters, motion)
        return self.heat.follow([heat_piece(motion, friction)])

    def torque(self, motion: Motion, warmth: Warmth | None = None) -> Array:
        """Evaluates the true torque (N, n) [N m or N] of a motion, which begins unstrained.

        Args:
            motion: the motion.
            warmth: its temperatures over time; by default those of a motion that begins cold.
        """
        now = self.warmth(motion) if warmth is None else warmth
        torque = self._torque_at_reference(motion)
        if now is None:
            return torque
        friction = reference_friction(self.model, self.parameters, motion)
        return np.asarray(torque + (now.factor(motion.t) - 1.0) * friction)

    def _torque_at_reference(self, motion: Motion) -> Array:
        if not self.effects:
            return self.model.torque(motion.q, motion.dq, motion.ddq, self.parameters)
        now = situation(self.model, self.parameters, motion.t, motion.q, motion.dq, motion.ddq)
        own = [effect for effect in self.effects if isinstance(effect, PlantEffect) and effect.term.loads_gear]
        weights = [LoadSource(e.term, e.joint, e.shape, np.asarray(e.coefficients)) for e in own]
        felt = ExtraGearLoad("effects", weights).on(now) if own else now
        return np.sum([now.torque, *(effect.torque(felt) for effect in self.effects)], axis=0)


def nominal_plant(
    robot: Robot,
    *,
    friction: str = "polynomial",
    velocity_scale: float = 1e-3,
    sensors: Sensors | None = None,
    spread: float = 0.0,
    seed: int = 0,
    overrides: Mapping[str, float] | None = None,
    effects: tuple[PlantEffect, ...] = (),
) -> Plant:
    """Builds the plant of a robot's own description.

    Args:
        robot: the robot; all its nominal dynamics must be known.
        friction: see `default_model`.
        velocity_scale: below which Coulomb friction fades, tanh(dq / scale) [rad/s]: a joint that stands feels none.
        sensors: what the log sees.
        spread: relative standard deviation by which the truth differs from the description: masses and frictions are
            scaled, centres of mass and inertias follow, so that every link stays a possible body.
        seed: of the differences.
        overrides: the truth of single standard parameters by name, such as ``f1_3``.
        effects: what it has beyond the model.

    Returns:
        The plant.

    Raises:
        InputError: the description lacks a parameter, a negative spread, or an override of no parameter.
    """
    if not spread >= 0:
        raise InputError(f"a spread of {spread}", allowed="zero or more")
    rng = np.random.default_rng(seed)
    inertia = _varied_inertia(np.asarray(robot.inertia, dtype=float), spread, rng)
    varied = replace(
        robot,
        inertia=inertia,
        friction=np.asarray(robot.friction) * rng.lognormal(0.0, spread, (robot.n, 1)),
        rotor_inertia=np.asarray(robot.rotor_inertia) * rng.lognormal(0.0, spread, robot.n),
    )
    model = default_model(robot, friction=friction, velocity_scale=velocity_scale)
    parameters = replace(model, robot=varied).nominal.copy()
    for name, value in (overrides or {}).items():
        if name not in model.names:
            near = get_close_matches(name, model.names, n=3)
            raise InputError(
                f"unknown parameter {name}",
                column="parameters",
                allowed=f"such as {', '.join(near or model.names[:3])}",
            )
        parameters[model.names.index(name)] = value
    if not np.isfinite(parameters).all():
        model.require_description("a virtual robot")
    return Plant(model=model, parameters=parameters, sensors=sensors or Sensors(), effects=effects)


def _varied_inertia(inertia: Array, spread: float, rng: np.random.Generator) -> Array:
    """Scales a body's mass by k and its lengths by s: moments of mass by k s, inertias by k s^2."""
    mass = rng.lognormal(0.0, spread, len(inertia))
    length = rng.lognormal(0.0, spread / 2, len(inertia))
    factors = np.column_stack([mass, *(mass * length,) * 3, *(mass * length**2,) * 6])
    return inertia * factors


def simulate(plant: Plant, motion: Motion, *, seed: int = 0, warmth: Warmth | None = None) -> Log:
    """Plays a motion on the plant and logs it as a controller would.

    Args:
        plant: the virtual robot.
        motion: the motion that the robot makes.
        seed: of the noise.
        warmth: temperatures of the joints of a plant with heat; by default the motion begins cold.

    Returns:
        A log of t, q (rounded by the encoders) and tau (with noise), and of temperatures where the plant has
        thermometers.

    Raises:
        InputError: a motion of another number of joints.
    """
    if motion.n != plant.robot.n:
        raise InputError(f"a motion of {motion.n} joints", allowed=f"{plant.robot.n}, as {plant.robot.name} has")
    now = plant.warmth(motion) if warmth is None else warmth
    tau = plant.torque(motion, now)
    seen = "none" if plant.heat is None else plant.heat.thermometers
    rng = np.random.default_rng(seed)
    period = float(np.median(np.diff(motion.t))) if len(motion) > 1 else 0.0
    return Log(
        t=motion.t,
        q=plant.sensors.position(motion.q, np.asarray(plant.robot.gear_ratio)),
        tau=plant.sensors.torque(tau, period, rng),
        temperature=now.at(motion.t) if now is not None and seen == "all" else None,
        ambient=np.full(len(motion), plant.heat.ambient) if plant.heat is not None and seen != "none" else None,
        name=f"virtual {plant.robot.name}",
        metadata={"assumed": list(plant.robot.assumed)} if plant.robot.assumed else {},
    )

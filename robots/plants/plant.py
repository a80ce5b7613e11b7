"""The virtual robot: a torque model with its true parameters, and the sensors that look at it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from difflib import get_close_matches

import numpy as np
from numpy.typing import NDArray

from robots.common.errors import InputError
from robots.plants.sensors import Sensors
from robots.regressor import TorqueModel, default_model
from robots.robot import Robot
from robots.signals import Log, Motion

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Plant:
    """A robot that obeys a torque model exactly.

    Attributes:
        model: the torque model with p parameters.
        parameters: the truth (p,).
        sensors: what the log sees of it.
    """

    model: TorqueModel
    parameters: Array
    sensors: Sensors = field(default_factory=Sensors)

    def __post_init__(self) -> None:
        """Checks the parameters.

        Raises:
            InputError: not one finite number per column.
        """
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


def nominal_plant(
    robot: Robot,
    *,
    friction: str = "polynomial",
    velocity_scale: float = 1e-3,
    sensors: Sensors | None = None,
    spread: float = 0.0,
    seed: int = 0,
    overrides: Mapping[str, float] | None = None,
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
    return Plant(model=model, parameters=parameters, sensors=sensors or Sensors())


def _varied_inertia(inertia: Array, spread: float, rng: np.random.Generator) -> Array:
    """Scales a body's mass by k and its lengths by s: moments of mass by k s, inertias by k s^2."""
    mass = rng.lognormal(0.0, spread, len(inertia))
    length = rng.lognormal(0.0, spread / 2, len(inertia))
    factors = np.column_stack([mass, *(mass * length,) * 3, *(mass * length**2,) * 6])
    return inertia * factors


def simulate(plant: Plant, motion: Motion, *, seed: int = 0) -> Log:
    """Plays a motion on the plant and logs it as a controller would.

    Args:
        plant: the virtual robot.
        motion: the motion that the robot makes.
        seed: of the noise.

    Returns:
        A log of t, q (rounded by the encoders) and tau (with noise).

    Raises:
        InputError: a motion of another number of joints.
    """
    if motion.n != plant.robot.n:
        raise InputError(f"a motion of {motion.n} joints", allowed=f"{plant.robot.n}, as {plant.robot.name} has")
    tau = plant.model.torque(motion.q, motion.dq, motion.ddq, plant.parameters)
    rng = np.random.default_rng(seed)
    period = float(np.median(np.diff(motion.t))) if len(motion) > 1 else 0.0
    return Log(
        t=motion.t,
        q=plant.sensors.position(motion.q, np.asarray(plant.robot.gear_ratio)),
        tau=plant.sensors.torque(tau, period, rng),
        name=f"virtual {plant.robot.name}",
    )

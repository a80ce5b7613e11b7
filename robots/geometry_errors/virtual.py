"""Virtual arms: measured poses of a robot with known geometric errors."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.geometry_errors.measurements import Measurement, Setup
from robots.geometry_errors.model import GeometryModel
from robots.geometry_errors.poses import MeasuredPoses, approaches
from robots.geometry_errors.terms import TERMS
from robots.robot import Robot

TURNS = np.pi  # positions of joints without limits are drawn within so much [rad]


def random_positions(robot: Robot, count: int, *, seed: int = 0, share: float = 0.9) -> Array:
    """Draws joint positions within the limits (N, n) [rad or m].

    Args:
        robot: the robot.
        count: N.
        seed: of the random numbers.
        share: of each range, around its middle.
    """
    lower = np.where(np.isfinite(robot.limits.lower), robot.limits.lower, -TURNS)
    upper = np.where(np.isfinite(robot.limits.upper), robot.limits.upper, TURNS)
    middle, half = (lower + upper) / 2.0, share * (upper - lower) / 2.0
    return middle + half * np.random.default_rng(seed).uniform(-1.0, 1.0, (count, robot.n))


def simulate_poses(
    robot: Robot,
    q: ArrayLike,
    measurement: Measurement,
    errors: Mapping[str, float],
    *,
    setup: Setup | None = None,
    noise: Mapping[str, float] | None = None,
    temperature: ArrayLike | None = None,
    velocity: ArrayLike | None = None,
    session: ArrayLike | None = None,
    seed: int = 0,
) -> MeasuredPoses:
    """Measures the poses of a robot with geometric errors.

    Args:
        robot: its nominal description.
        q: joint positions as the controller reads them, in the order of the poses (N, n) [rad or m].
        measurement: what the instrument measures.
        errors: values of parameters by name, such as ``{"zero_2": 0.004}`` [SI]; the others are zero.
        setup: where instrument and markers are; a usual one by default.
        noise: standard deviation of the measurement by unit: "m", "rad", "px".
        temperature: (N,) [degC]; the description holds at their mean.
        velocity: of the joints (N, n) [rad/s or m/s].
        session: number of the session of each pose (N,).
        seed: of the noise.

    Returns:
        The measured poses.

    Raises:
        InputError: an unknown parameter, or a measurement that cannot be simulated.
    """
    positions = np.asarray(q, dtype=float)
    poses = MeasuredPoses(
        q=positions,
        measurement=measurement,
        observed=np.full((len(positions), len(measurement.columns)), np.nan),
        temperature=None if temperature is None else np.asarray(temperature, dtype=float),
        velocity=None if velocity is None else np.asarray(velocity, dtype=float),
        session=None if session is None else np.asarray(session, dtype=np.int64),
        approach=approaches(positions),
    )
    model = GeometryModel([robot], TERMS, poses)
    names = [item.name for item in model.errors]
    unknown = next((name for name in errors if name not in names), None)
    if unknown is not None:
        raise InputError(f"unknown geometric error {unknown!r}", allowed=", ".join(names[:3]) + ", ...")
    values = np.array([errors.get(name, 0.0) for name in names])
    place = measurement.example if setup is None else setup
    return replace(poses, observed=measurement.simulate(model.flanges(values), place, noise or {}, seed))

"""The verb: runs an experiment's path at the speed that the limits allow."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from oed.criteria import criterion as choose_criterion
from oed.experiments.checks import usable_limits
from oed.experiments.quality import design_model, measure
from oed.experiments.results.retimed import RetimedExperiment, torque_use
from oed.experiments.safety_checks.freedom import freedom_of
from oed.experiments.safety_checks.margins import measured_margins
from oed.exports import shorter_way
from oed.retiming import Retimed, retime_with_stops
from oed.retiming import retime as retime_by_toppra
from robots.base_parameters import find_base_parameters
from robots.collision import Surroundings
from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.limits import Limits
from robots.regressor import TorqueModel
from robots.robot import Robot
from robots.signals import Motion
from robots.terms import FrictionTerm

METHODS = ("toppra", "ruckig")


def retime(
    robot: Robot,
    motion: Motion | ArrayLike,
    *,
    method: str = "toppra",
    criterion: str = "cond",
    friction: str = "polynomial",
    velocity_scale: float = 0.02,
    tolerance: float = 0.01,
    collision: bool = True,
    surroundings: Surroundings | None = None,
) -> RetimedExperiment:
    """Runs through the path of a motion, or through waypoints, as fast as the robot's limits allow.

    ``toppra`` is TOPP-RA (Pham and Pham 2018), ``ruckig`` the generator of Berscheid and Kröger (2021).
    Through waypoints ``toppra`` lays a smooth path that stops only where it turns back. It is compared with straight
    moves that stop at each waypoint.

    Args:
        robot: the robot; its torque limits count where its nominal dynamics are described.
        motion: the path, with its present timing; or waypoints (W, n) [rad or m], between which joints without end
            take the shorter way.
        method: ``toppra`` follows the path; ``ruckig`` moves straight from vertex to vertex and stops at each.
        criterion: what to compare, see `oed.design`.
        friction: the model whose parameters are meant.
        velocity_scale: of its Coulomb column.
        tolerance: how far ruckig's polyline may leave the path [rad or m].
        collision: check the new motion for collisions; where it collides, the result says so.
        surroundings: the floor, and boxes that the arm must not enter.

    Returns:
        The new motion and the criterion before and after.

    Raises:
        InputError: an unknown method or criterion, a motion of another number of joints, or waypoints that are not
            two or more finite points.
        InfeasibleError: a path that no timing makes possible.
    """
    if method not in METHODS:
        raise InputError(f"retiming method {method!r}", allowed=", ".join(METHODS))
    if not isinstance(motion, Motion):
        motion = shorter_way(robot, motion)
    stops = None if isinstance(motion, Motion) else _with_stops(robot, motion)
    given = motion if isinstance(motion, Motion) else stops.motion  # type: ignore[union-attr]
    if given.n != robot.n:
        raise InputError(f"a motion of {given.n} joints", allowed=f"{robot.n}, as {robot.name} has")
    chosen = choose_criterion(criterion)
    settings: dict[str, Any] = {"friction": friction, "velocity_scale": velocity_scale, "rotor": True, "offset": False}
    model = design_model(robot, settings)
    base = find_base_parameters(model)
    limits = _limits(robot)
    if method == "toppra":
        rigid, losses = _dynamics(model)
        retimed = retime_by_toppra(motion, limits, period=robot.period, inverse_dynamics=rigid, friction=losses)
    else:
        retimed = retime_with_stops(motion, limits, period=robot.period, tolerance=tolerance)
    if stops is not None:
        retimed = replace(retimed, duration_before=stops.duration_after, usage_before=stops.usage, waypoints=True)
    bodies = (surroundings or Surroundings()).model(robot) if collision else None
    return RetimedExperiment(
        robot=robot,
        base=base,
        criterion=chosen.name,
        before=measure("before", base, given),
        after=measure("after", base, retimed.motion),
        retimed=retimed,
        torque_before=torque_use(base, given),
        torque_after=torque_use(base, retimed.motion),
        margins=measured_margins(robot, retimed.motion, base),
        settings=settings,
        freedom=None if bodies is None else freedom_of(bodies, retimed.motion),
    )


def move_with_stops(robot: Robot, waypoints: ArrayLike) -> Motion:
    """Moves straight from waypoint to waypoint and stops at each: what `retime` compares waypoints with.

    Args:
        robot: the robot.
        waypoints: (W, n) [rad or m].

    Raises:
        InputError: waypoints that are not two or more finite points of the robot's joints.
        InfeasibleError: a waypoint outside the position limits, a zero limit, or waypoints that are all equal.
    """
    return _with_stops(robot, shorter_way(robot, waypoints)).motion


def _with_stops(robot: Robot, waypoints: ArrayLike) -> Retimed:
    return retime_with_stops(waypoints, _limits(robot), period=robot.period)


def _limits(robot: Robot) -> Limits:
    """The path may go to the ends of the ranges; speed and its derivatives keep the reserve of a design."""
    return replace(usable_limits(robot.limits), lower=robot.limits.lower, upper=robot.limits.upper)


def _dynamics(
    model: TorqueModel,
) -> tuple[Callable[[Array, Array, Array], Array] | None, Callable[[Array], Array] | None]:
    """The nominal torque without and of friction, or nothing where the robot's description does not give it."""
    robot = model.robot
    if not (model.described and np.isfinite(robot.limits.torque).any()):
        return None, None
    smooth = TorqueModel(robot, tuple(term for term in model.terms if not isinstance(term, FrictionTerm)))
    friction = TorqueModel(robot, tuple(term for term in model.terms if isinstance(term, FrictionTerm)))

    def rigid(q: Array, dq: Array, ddq: Array) -> Array:
        return smooth.torque(q, dq, ddq, smooth.nominal)

    def losses(dq: Array) -> Array:
        return friction.torque(np.zeros_like(dq), dq, np.zeros_like(dq), friction.nominal)

    return rigid, losses

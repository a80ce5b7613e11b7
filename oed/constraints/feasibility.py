"""Checks before the solver starts whether workspace limits allow any experiment, and which limit would."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import least_squares, minimize

from oed.constraints.geometric import CollisionLimit, GeometricLimits
from oed.constraints.tool import ToolBox
from oed.constraints.torque import TorqueLimit
from robots.collision import CollisionModel, Plane
from robots.collision.pairs import random_poses
from robots.common.arrays import Array
from robots.common.errors import InfeasibleError, InputError
from robots.robot import Robot

DRAWN_POSES = 4000  # poses from which the tool's nearest approach to its box is sought
SEARCH_STARTS = 6
BOX_TOLERANCE = 1e-5  # of the box's distance, below which the tool is within it [m]


def check_feasible(robot: Robot, limits: GeometricLimits, home: ArrayLike) -> None:
    """Checks that a robot may stand at the pose where an experiment starts, and that its tool can enter its box.

    Args:
        robot: the robot.
        limits: its limits in space.
        home: the start pose (n,) [rad or m].

    Raises:
        InputError: a pose of the wrong shape.
        InfeasibleError: the start pose is beyond a joint's limit, in collision, out of the tool box, on the wrong side
            of a plane or too near to a singular pose; an obstacle is above the robot's foot; or no pose at all brings
            the tool into its box. The message has the number that would do.
    """
    q = np.asarray(home, dtype=np.float64)
    if q.shape != (robot.n,) or not np.isfinite(q).all():
        raise InputError(f"a start pose {q}", allowed=f"{robot.n} finite numbers, one per joint")
    _check_joints(robot, q)
    for limit in limits.limits:
        if isinstance(limit, ToolBox):
            _check_box(robot, limit)
        if isinstance(limit, CollisionLimit):
            _check_feet(limit)
    for limit in limits.limits:
        if isinstance(limit, CollisionLimit):
            _check_clearance(limit, limits, q)
    values = limits.linearise(q)[0][0]
    # Smooth clearances are a little small; whether bodies overlap was judged by the exact ones.
    others = [row for row, (name, limit) in enumerate(_labelled(limits)) if not isinstance(limit, CollisionLimit)]
    wrong = [row for row in others if values[row] < -BOX_TOLERANCE]
    if wrong:
        row = min(wrong, key=lambda index: values[index])
        unit = f" {limits.units[row]}" if limits.units[row] else ""
        raise InfeasibleError(
            f"the start pose violates the limit {limits.labels[row]!r} by {-values[row]:.3g}{unit}",
            allowed=f"a limit that is {-values[row]:.3g}{unit} wider, or another start pose",
            remedy=_advice(nearest_feasible(limits, q), limits),
        )


def _labelled(limits: GeometricLimits) -> list[tuple[str, object]]:
    return [(name, limit) for limit in limits.limits for name in limit.names(limits.robot)]


def _check_joints(robot: Robot, q: Array) -> None:
    lower, upper = robot.limits.lower, robot.limits.upper
    outside = np.flatnonzero((q < lower) | (q > upper))
    if len(outside):
        joint = int(outside[0])
        allowed = f"{lower[joint]:.4g} to {upper[joint]:.4g}"
        raise InfeasibleError(f"the start pose has {q[joint]:.4g}", joint=joint + 1, allowed=allowed)


def _check_feet(limit: CollisionLimit) -> None:
    """A plane above the first joint cannot be kept in any pose."""
    foot = limit.model.chain.joints[0].translation
    for obstacle in limit.model.obstacles:
        if isinstance(obstacle, Plane):
            height = float(obstacle.normal @ foot)
            if obstacle.offset > height:
                raise InfeasibleError(
                    (
                        f"{obstacle.name!r} at {obstacle.offset:.4g} m is above the first joint, which is at "
                        f"{height:.4g} m"
                    ),
                    allowed=f"less than {height:.4g} m minus the size of the first link",
                    remedy="heights refer to the robot's base frame: a floor below the base has a negative height",
                )


def _check_clearance(limit: CollisionLimit, limits: GeometricLimits, q: Array) -> None:
    model: CollisionModel = limit.model
    clearance = model.clearance(q)[0]
    if not (clearance < limit.margin).any():
        return
    row = int(np.argmin(clearance))
    lacking = limit.margin - clearance[row]
    pair = model.pairs[row]
    what = f"overlap by {-1e3 * clearance[row]:.1f} mm"
    if clearance[row] >= 0.0:
        what = f"are {1e3 * clearance[row]:.1f} mm apart, less than the margin of {1e3 * limit.margin:.1f} mm"
    allowed = f"{1e3 * lacking:.1f} mm more between them"
    if isinstance(pair.first, Plane):
        allowed = f"a plane at {pair.first.offset - lacking:.4g} m or lower instead of {pair.first.offset:.4g} m"
    problem = f"in the start pose {pair.first.name!r} and {pair.second.name!r} {what}"
    raise InfeasibleError(problem, allowed=allowed, remedy=_advice(nearest_feasible(limits, q), limits))


def _advice(pose: Array | None, limits: GeometricLimits) -> str:
    if pose is None:
        return "no pose nearby respects all limits: widen them"
    unit = limits.robot.limits.position_unit
    return f"the nearest pose that respects all limits is {', '.join(f'{x:.3f}' for x in pose)} {unit}"


def nearest_feasible(limits: GeometricLimits, home: ArrayLike, *, seed: int = 0, room: float = 0.0) -> Array | None:
    """Looks for the pose nearest to a given one that keeps all limits.

    Args:
        limits: the limits.
        home: (n,) [rad or m].
        seed: of the further starts, for where bodies are deep in each other no direction leads out.
        room: to keep from every bound, in its own scale.

    Returns:
        The first local solution found (n,), sought from that pose first, else a pose of `roomy_pose`.
    """
    robot, q = limits.robot, np.asarray(home, dtype=np.float64)
    lower, upper = robot.limits.lower, robot.limits.upper
    function, random = limits.symbolic(), np.random.default_rng(seed)

    def values(x: Array) -> Array:
        return np.array(function(x)[0])[:, 0] - room

    def distance(x: Array) -> tuple[float, Array]:
        return float((x - q) @ (x - q)), 2.0 * (x - q)

    rows: Any = {"type": "ineq", "fun": values, "jac": lambda x: np.array(function(x)[1])}
    for attempt in range(SEARCH_STARTS):
        start = np.clip(q + random.normal(scale=0.2 * attempt, size=robot.n), lower, upper)
        result = minimize(
            distance,
            start,
            jac=True,
            bounds=list(zip(lower, upper, strict=True)),
            constraints=[rows],
            method="SLSQP",
            options={"maxiter": 60},
        )
        pose = np.clip(result.x, lower, upper)
        if np.isfinite(pose).all() and values(pose).min(initial=np.inf) >= -BOX_TOLERANCE:
            return np.asarray(pose)
    return roomy_pose(limits, q, seed=seed)


def roomy_pose(
    limits: GeometricLimits, home: Array, *, torque: TorqueLimit | None = None, seed: int = 0
) -> Array | None:
    """Looks for a pose that keeps all limits with room around it, so that motions can start there.

    Args:
        limits: the limits in space.
        home: (n,) [rad or m].
        torque: which has to hold the pose.
        seed: of the poses that are tried.

    Returns:
        Of the poses (n,) with a tenth of the limits' scale to every bound, or nearly the most that any has, the one
        nearest to `home`; None where no pose was found that keeps all limits.
    """
    q = random_poses(limits.robot.limits, DRAWN_POSES, seed)
    still = np.zeros_like(q)
    if torque is not None:
        # A start pose takes at most 95 % of the usable torque.
        q = q[(np.abs(torque.values(q, still, still)) <= 0.95).all(axis=1)]
    room = limits.values(q, q, q).min(axis=1, initial=np.inf)
    if room.max(initial=-np.inf) < 0.0:
        return None
    # Around a start pose there should be a tenth of the limits' scale, mostly [m].
    enough = np.flatnonzero(room >= min(0.1, 0.8 * room.max()))
    return np.round(q[enough[np.linalg.norm(q[enough] - home, axis=1).argmin()]], 3)


def tool_approach(robot: Robot, box: ToolBox, *, seed: int = 0) -> tuple[float, Array]:
    """Looks for how near the tool comes to its box, over random poses and then locally.

    Args:
        robot: the robot.
        box: the tool box.
        seed: of the poses.

    Returns:
        The smallest distance found [m], zero within the box, and the tool's place there (3,) [m].
    """
    lower, upper = robot.limits.lower, robot.limits.upper
    span = np.where(np.isfinite(upper - lower), upper - lower, 2.0 * np.pi)
    low = np.where(np.isfinite(lower), lower, np.where(np.isfinite(upper), upper - span, -np.pi))
    q = low + span * np.random.default_rng(seed).uniform(0.001, 0.999, (DRAWN_POSES, robot.n))
    distances = np.linalg.norm(_beyond(robot, box, q), axis=1)
    best = q[int(distances.argmin())]

    def beyond(x: Array) -> Array:
        return _beyond(robot, box, x[None])[0]

    if distances.min() > 0.0:
        for start in q[np.argsort(distances)[:SEARCH_STARTS]]:
            slope = partial(_slope, robot, box)
            result = least_squares(beyond, start, slope, (low, low + span))
            if np.linalg.norm(_beyond(robot, box, result.x[None])) < np.linalg.norm(_beyond(robot, box, best[None])):
                best = result.x
    return float(np.linalg.norm(_beyond(robot, box, best[None]))), _tool(robot, box, best[None])[0]


def _tool(robot: Robot, box: ToolBox, q: Array) -> Array:
    flange = robot.chain.flange(q)
    return np.asarray(flange[:, :3, 3] + flange[:, :3, :3] @ np.array(box.point))


def _beyond(robot: Robot, box: ToolBox, q: Array) -> Array:
    """How far outside of its box the tool is (N, 3) [m]."""
    place = _tool(robot, box, q)
    return place - np.clip(place, box.lower, box.upper)


def _slope(robot: Robot, box: ToolBox, q: Array) -> Array:
    """Derivative of `_beyond` at one pose (3, n)."""
    chain, place, poses = robot.chain, _tool(robot, box, q[None])[0], robot.chain.transforms(q)
    columns = []
    for joint, pose in zip(chain.joints, poses, strict=True):
        axis = pose[:3, :3] @ joint.axis
        columns.append(axis if joint.kind == "prismatic" else np.cross(axis, place - pose[:3, 3]))
    outside = (place < box.lower) | (place > box.upper)
    return np.column_stack(columns) * outside[:, None]


def _check_box(robot: Robot, box: ToolBox) -> None:
    distance, place = tool_approach(robot, box)
    if distance <= BOX_TOLERANCE:
        return
    wider = []
    for axis, x, low, high in zip("xyz", place, box.lower, box.upper, strict=True):
        if x < low:
            wider.append(f"{axis} from {x:.4g} m instead of {low:g} m")
        elif x > high:
            wider.append(f"{axis} up to {x:.4g} m instead of {high:g} m")
    raise InfeasibleError(
        (
            f"the tool cannot reach its box; the smallest distance is {distance:.3g} m, at "
            f"({', '.join(f'{x:.4g}' for x in place)}) m"
        ),
        allowed=f"a box with {' and '.join(wider)}",
    )

"""Collision models of robots: from what their files state, or from their chains alone."""

from __future__ import annotations

import warnings
from collections.abc import Collection
from pathlib import Path

import numpy as np

from robots.collision.boxes import FLOOR, Plane, Scene, stated_scene
from robots.collision.boxes import floor as floor_at
from robots.collision.capsules import Capsule, has_extent, numbered, segment_capsules, stated_capsules
from robots.collision.drawn.links import drawn_links
from robots.collision.model import SMOOTHING, CollisionModel
from robots.collision.pairs import always_touching, random_poses, sampled_poses
from robots.common.config import read_config
from robots.common.errors import AssumedValueWarning, InputError
from robots.description import CollisionDescription, RobotDescription
from robots.geometry.chain import Chain
from robots.limits import Limits
from robots.loading import CATALOG, catalogue, load_robot
from robots.robot import Robot

RADIUS_FRACTION = 0.06
"""Radius of a link without stated capsules as a share of the reach: 42 mm of 0.7 m, 78 mm of 1.3 m."""

_warned: set[str] = set()  # models whose assumed shapes were already reported in this process


def collision_model(
    robot: Robot,
    *,
    scene: Scene | None = None,
    floor: float | bool = True,
    ignored: Collection[frozenset[int | str]] = (),
    radius_fraction: float = RADIUS_FRACTION,
    smoothing: float = SMOOTHING,
    description: CollisionDescription | None = None,
) -> CollisionModel:
    """Make the collision model of a robot.

    The shapes are those of the robot's YAML; without any, capsules about the shapes of its URDF; without those,
    capsules along the links.

    Args:
        robot: the robot.
        scene: obstacles, in addition to those of the robot's file.
        floor: height of a floor in the base frame [m]. True is that of the robot's file, else the plane that the base
            is mounted on; False is none. A scene's own floor goes before.
        ignored: pairs that may touch, in addition to those of the file.
        radius_fraction: radius of the links as a share of the reach, where the file states no capsules.
        smoothing: how much too small a smooth clearance may be [m].
        description: shapes in place of those of the robot's file.

    Returns:
        The model.

    Raises:
        InputError: naming the file, on shapes that do not fit the robot.

    Warns:
        AssumedValueWarning: once per process and robot, when the model rests on shapes that no source backs.
    """
    stated = description
    own_links = True
    if stated is None:
        stated, own_links = stated_collision(robot)
    try:
        reason, span, bodies = "", None, None
        drawn_boxes, touching = Scene(), set[frozenset[int | str]]()
        apart: Collection[frozenset[int]] = ()
        if stated.links and own_links:
            capsules = stated_capsules(stated.links, robot.chain)
        else:
            drawn = drawn_links(robot) if description is None else None
            if drawn is None:
                # Links without any extent have no shape to assume: such a robot cannot be checked.
                capsules = assumed = segment_capsules(robot.chain, radius_fraction) if has_extent(robot.chain) else ()
            else:
                drawn_boxes, span, bodies = Scene(obstacles=drawn.boxes), drawn.span, drawn.bodies
                touching, apart = {*drawn.ignored, *drawn.joined}, drawn.apart
                along = segment_capsules(robot.chain, radius_fraction) if drawn.without else ()
                assumed = tuple(along[link] for link in drawn.without)
                capsules = numbered([*drawn.capsules, *assumed])
            if assumed:
                reason = f"radius {1e3 * assumed[0].radius:.0f} mm = {radius_fraction:g} of the reach, "
        given = any(obstacle.name == FLOOR for obstacle in (scene or Scene()).obstacles)
        ground = None if given else _floor(robot, stated, floor, span)
        if ground is not None and floor is True and stated.floor is None:
            touching |= always_touching(ground, capsules, sampled_poses(robot.chain, robot.limits))
        model = CollisionModel(
            name=robot.name,
            chain=robot.chain,
            limits=robot.limits,
            capsules=capsules,
            scene=Scene(obstacles=() if ground is None else (ground,))
            + stated_scene(stated)
            + drawn_boxes
            + (scene or Scene()),
            ignored=(*(frozenset(pair) for pair in stated.ignore), *touching, *ignored),
            apart=apart,
            bodies=bodies,
            smoothing=smoothing,
        )
    except InputError as error:
        if error.file is None and description is None and robot.origin:
            error.file = robot.origin
        raise
    _warn(robot, model.capsules, reason)
    return model


def _floor(
    robot: Robot, stated: CollisionDescription, floor: float | bool, span: tuple[float, float] | None
) -> Plane | None:
    """The floor that is asked for: one at a height, that of the file or of the base, or none."""
    if floor is False:
        return None
    if floor is not True:
        return floor_at(float(floor))
    return base_plane(robot.chain, robot.limits, span) if stated.floor is None else floor_at(stated.floor)


def stated_collision(robot: Robot) -> tuple[CollisionDescription, bool]:
    """Reads the collision part of the robot's file, and whether its link numbers are those of this robot.

    Args:
        robot: of the catalogue, a YAML, or another file, which states none.

    Raises:
        InputError: the file is wrong or has moved.
    """
    if robot.origin in catalogue():
        path = CATALOG / f"{robot.origin}.yaml"
    else:
        path = Path(robot.origin)
        if path.suffix.lower() not in (".yaml", ".yml"):
            return CollisionDescription(), True
    stated = read_config(path, RobotDescription).collision
    if stated is None:
        return CollisionDescription(), True
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AssumedValueWarning)
        own = load_robot(robot.origin)
    return stated, own.joint_names == robot.joint_names


def _warn(robot: Robot, capsules: tuple[Capsule, ...], reason: str) -> None:
    assumed = [capsule.name for capsule in capsules if capsule.source == "assumed"]
    key = f"{robot.origin or robot.name}|{reason}"
    if assumed and key not in _warned:
        _warned.add(key)
        message = (
            f"{robot.name}: the link shapes for collision checks are assumed values without a source "
            f"({reason}{', '.join(assumed)})"
        )
        warnings.warn(message, AssumedValueWarning, stacklevel=3)


def base_plane(chain: Chain, limits: Limits, span: tuple[float, float] | None = None) -> Plane | None:
    """Finds the plane that an arm is mounted on: across its first turning axis, at the far end of its base.

    Args:
        chain: the arm.
        limits: of its joints.
        span: lowest and highest point of the base along z of its frame [m]; by default the frame's origin.

    Returns:
        The plane with its free side towards the arm. None where the first turning axis is not along z of the base
        frame: then the description does not say what the robot is mounted on.
    """
    turning = [joint for joint, kind in enumerate(chain.kinds) if kind != "prismatic"]
    if not turning:
        return None
    q = random_poses(limits, 100)
    poses = chain.transforms(q)
    axis = poses[:, turning[0], :3, :3] @ chain.joints[turning[0]].axis
    # A first axis that leans by more than 10 degrees says nothing of where the mounting plane is.
    if np.abs(axis[:, 2]).min() < float(np.cos(np.deg2rad(10.0))):
        return None
    low, high = span or (0.0, 0.0)
    arm = float(np.mean(chain.flange(q)[:, 2, 3])) - (low + high) / 2.0
    below = arm >= 0.0
    # Meshes end somewhere near a round height.
    offset = round(low if below else -high, 4) + 0.0  # not -0
    return Plane(name=FLOOR, normal=np.array([0.0, 0.0, 1.0 if below else -1.0]), offset=offset)

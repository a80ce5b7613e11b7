"""Collision models of robots: from what their files state, or from their chains alone."""

from __future__ import annotations

import warnings
from collections.abc import Collection
from pathlib import Path

from robots.collision.boxes import Scene, stated_scene
from robots.collision.capsules import Capsule, numbered, segment_capsules, stated_capsules
from robots.collision.drawn.links import drawn_links
from robots.collision.model import SMOOTHING, CollisionModel
from robots.common.config import read_config
from robots.common.errors import AssumedValueWarning, InputError
from robots.description import CollisionDescription, RobotDescription
from robots.loading import CATALOG, catalogue, load_robot
from robots.robot import Robot

RADIUS_FRACTION = 0.06
"""Radius of a link without stated capsules as a share of the reach: 42 mm of 0.7 m, 78 mm of 1.3 m."""

_warned: set[str] = set()  # models whose assumed shapes were already reported in this process


def collision_model(
    robot: Robot,
    *,
    scene: Scene | None = None,
    ignored: Collection[frozenset[int | str]] = (),
    radius_fraction: float = RADIUS_FRACTION,
    smoothing: float = SMOOTHING,
    description: CollisionDescription | None = None,
) -> CollisionModel:
    """Make the collision model of a robot.

    The shapes are those of the robot's YAML; without any, capsules about the collision shapes of its URDF; without
    those, capsules along the links.

    Args:
        robot: the robot.
        scene: obstacles, in addition to those of the robot's file.
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
        shapes, reason = Scene(), ""
        touching: tuple[frozenset[int | str], ...] = ()
        if stated.links and own_links:
            capsules = stated_capsules(stated.links, robot.chain)
        else:
            drawn = drawn_links(robot) if description is None else None
            if drawn is None:
                capsules = assumed = segment_capsules(robot.chain, radius_fraction)
            else:
                shapes, touching = Scene(obstacles=drawn.boxes), drawn.ignored
                assumed = tuple(segment_capsules(robot.chain, radius_fraction)[link] for link in drawn.without)
                capsules = numbered([*drawn.capsules, *assumed])
            if assumed:
                reason = f"radius {1e3 * assumed[0].radius:.0f} mm = {radius_fraction:g} of the reach, "
        model = CollisionModel(
            name=robot.name,
            chain=robot.chain,
            limits=robot.limits,
            capsules=capsules,
            scene=stated_scene(stated) + shapes + (scene or Scene()),
            ignored=(*(frozenset(pair) for pair in stated.ignore), *touching, *ignored),
            smoothing=smoothing,
        )
    except InputError as error:
        if error.file is None and description is None and robot.origin:
            error.file = robot.origin
        raise
    _warn(robot, model.capsules, reason)
    return model


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

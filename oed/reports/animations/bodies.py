"""What of a robot and its surroundings is drawn: meshes and shapes of its URDF, capsules, and obstacles."""

from __future__ import annotations

import warnings
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from oed.reports.animations.surfaces import (
    Surface,
    box_surface,
    capsule_surface,
    cylinder_surface,
    decimated,
)
from robots.collision import Box, Capsule, CollisionModel, Plane, Surroundings, reach, segment_capsules
from robots.collision.boxes import stated_scene
from robots.collision.drawn.fitting import load_mesh
from robots.collision.drawn.shapes import shapes_by_link
from robots.collision.loading import RADIUS_FRACTION, stated_collision
from robots.common.arrays import Array
from robots.common.errors import AssumedValueWarning, InputError
from robots.geometry.urdf_shapes import UrdfShape
from robots.robot import Robot

Kind = Literal["mesh", "shape", "capsule", "obstacle", "plane"]

TRIANGLES = 4000
"""Triangles of a whole robot: a canvas without a graphics card draws so many thirty times a second."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Body:
    """Something that is drawn.

    Attributes:
        name: what people call it.
        link: the link that carries it: 0 the base, i the link that joint i moves.
        kind: mesh or shape of the URDF, capsule of a link, or an obstacle or plane in the base frame.
        surface: its triangles in the link's frame.
    """

    name: str
    link: int
    kind: Kind
    surface: Surface


def bodies_of(robot: Robot, surroundings: Surroundings | None = None) -> tuple[Body, ...]:
    """Collects what is drawn of a robot, of its floor and of the obstacles in its file.

    A link is drawn with the visual shapes of its URDF, else with the collision shapes, else with the capsules of its
    collision model.

    Args:
        robot: the robot.
        surroundings: the floor, and further boxes.

    Warns:
        AssumedValueWarning: for each mesh that is not found or cannot be read, and for a robot's file that has moved;
            capsules are drawn instead.
    """
    drawn = _drawn(robot)
    without = set(range(robot.n + 1)) - {body.link for body in drawn}
    around = surroundings or Surroundings()
    model = checked_model(robot, around)
    capsules: tuple[Capsule, ...] = ()
    if without - {0} or not drawn:
        capsules = model.capsules if model is not None else _capsules(robot)
    return (
        *drawn,
        *(
            Body(
                name=capsule.name,
                link=capsule.link,
                kind="capsule",
                surface=capsule_surface(capsule.start, capsule.end, capsule.radius),
            )
            for capsule in capsules
            if capsule.link in without
        ),
        *_obstacles(robot, model, around),
    )


def checked_model(robot: Robot, surroundings: Surroundings | None) -> CollisionModel | None:
    """Makes the collision model; None where the robot's file gives none that fits.

    Args:
        robot: the robot.
        surroundings: the floor, and further boxes; the robot's own by default.
    """
    with warnings.catch_warnings(), suppress(InputError):
        # Whether a shape is assumed matters for distances, which a picture does not state.
        warnings.simplefilter("ignore", AssumedValueWarning)
        return (surroundings or Surroundings()).model(robot)
    return None


def _capsules(robot: Robot) -> tuple[Capsule, ...]:
    """Capsules along the links; none of an arm without extent, which has no link to draw."""
    with suppress(InputError):
        return segment_capsules(robot.chain, RADIUS_FRACTION)
    return ()


def _drawn(robot: Robot) -> tuple[Body, ...]:
    try:
        visual, collision = shapes_by_link(robot, "visual"), shapes_by_link(robot, "collision")
    except InputError as error:
        warnings.warn(f"{robot.name}: {error}; capsules are drawn instead", AssumedValueWarning, stacklevel=4)
        return ()
    found: list[Body] = []
    places = [place for place in robot.links if place.name in visual or place.name in collision]
    most = TRIANGLES // max(len(places), 1)
    for place in places:
        for shapes in (visual.get(place.name, ()), collision.get(place.name, ())):
            bodies = [
                body for shape in shapes if (body := _body(robot, shape, place.body, place.pose, most)) is not None
            ]
            if bodies:
                found += bodies
                break
    return tuple(found)


def _body(robot: Robot, shape: UrdfShape, link: int, pose: Array, most: int) -> Body | None:
    """Makes a body of a shape; None of a mesh that is not there."""
    try:
        surface = _surface(shape, robot.urdf, most)
    except InputError as error:
        warnings.warn(f"{robot.name}: {error}; another shape is drawn instead", AssumedValueWarning, stacklevel=4)
        return None
    kind: Kind = "mesh" if shape.kind == "mesh" else "shape"
    return Body(name=shape.link, link=link, kind=kind, surface=surface.moved(pose @ shape.pose))


def _surface(shape: UrdfShape, source: str | Path, most: int) -> Surface:
    if shape.kind == "mesh":
        return decimated(Surface(*load_mesh(shape, source), closed=False), most)
    if shape.kind == "box":
        return box_surface(np.array(shape.size))
    if shape.kind == "cylinder":
        return cylinder_surface(*shape.size)
    half = np.array([0.0, 0.0, shape.size[1] / 2.0 if shape.kind == "capsule" else 0.0])
    return capsule_surface(-half, half, shape.size[0])


def _obstacles(robot: Robot, model: CollisionModel | None, surroundings: Surroundings) -> tuple[Body, ...]:
    try:
        stated, _ = stated_collision(robot)
    except InputError as error:
        warnings.warn(f"{robot.name}: {error}; obstacles are not drawn", AssumedValueWarning, stacklevel=4)
        return ()
    bodies = []
    planes = [] if model is None else [obstacle for obstacle in model.obstacles if isinstance(obstacle, Plane)]
    for obstacle in (*planes, *stated_scene(stated).obstacles, *surroundings.keep_out):
        if isinstance(obstacle, Plane):
            surface, kind = _plane_surface(obstacle, 1.2 * reach(robot.chain)), "plane"
        elif isinstance(obstacle, Box):
            surface, kind = box_surface(obstacle.size).moved(obstacle.pose), "obstacle"
        else:
            surface, kind = capsule_surface(obstacle.start, obstacle.end, obstacle.radius), "obstacle"
        bodies.append(Body(name=obstacle.name, link=0, kind=kind, surface=surface))  # type: ignore[arg-type]
    return tuple(bodies)


def _plane_surface(plane: Plane, half: float) -> Surface:
    """A square of the plane about the point next to the base."""
    across = np.linalg.svd(plane.normal[None, :])[2][1:]
    corners = [plane.offset * plane.normal + half * (x * across[0] + y * across[1]) for x, y in _SQUARE]
    return Surface(np.array(corners), np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int64), closed=False)


_SQUARE = ((-1, -1), (1, -1), (1, 1), (-1, 1))

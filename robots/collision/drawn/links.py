"""Collision bodies of a robot from the ``<collision>`` shapes of its URDF."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from robots.collision.boxes import Box, Obstacle
from robots.collision.capsules import Capsule, numbered
from robots.collision.drawn.fitting import Balls, fit_capsule, shape_balls
from robots.collision.pairs import POSES, Pair, poses_of, random_poses, reference_pose
from robots.common.errors import AssumedValueWarning, InputError
from robots.geometry.urdf_shapes import UrdfShape, collision_shapes
from robots.robot import Robot

Array = NDArray[np.float64]

MOST = 4  # capsules of a body; more shapes are joined
JOIN = 1.1  # two are joined where one capsule about both is at most so much larger


@dataclass(frozen=True, kw_only=True, eq=False)
class DrawnLinks:
    """What the shapes of a URDF make.

    Attributes:
        capsules: of the links that have shapes.
        boxes: those of the base, as they are.
        ignored: links and boxes of the base that touch by construction.
        without: links, 0 for the base, of which a shape is missing or cannot be read.
    """

    capsules: tuple[Capsule, ...]
    boxes: tuple[Box, ...]
    ignored: tuple[frozenset[int | str], ...]
    without: tuple[int, ...]


# A design, its check and its campaign ask for the same robot; meshes take their time.
@lru_cache(maxsize=8)
def drawn_links(robot: Robot) -> DrawnLinks | None:
    """Fits capsules to the collision shapes of a robot's URDF.

    Args:
        robot: a robot; one that is not from a URDF, or whose URDF has no collision shapes, gives None.

    Raises:
        InputError: naming the link, on a shape that is not possible.

    Warns:
        AssumedValueWarning: naming meshes that are not found or cannot be read.
    """
    shapes = collision_shapes(robot.urdf) if robot.urdf and robot.links else {}
    if not any(place.name in shapes for place in robot.links):
        return None
    parts: dict[int, list[tuple[str, Balls]]] = {}
    boxes: list[Box] = []
    unread: list[tuple[int, str]] = []
    drawn: set[int] = set()
    for place in robot.links:
        for shape in shapes.get(place.name, ()):
            if place.body == 0 and shape.kind == "box":
                boxes.append(_box(shape, place.pose, len(boxes)))
                drawn.add(0)
                continue
            try:
                balls = shape_balls(shape, robot.urdf)
            except InputError as error:
                unread.append((place.body, str(error)))
                continue
            drawn.add(place.body)
            parts.setdefault(place.body, []).extend((place.name, part.moved(place.pose)) for part in balls)
    for _, text in dict.fromkeys(unread):
        warnings.warn(f"{robot.name}: {text}", AssumedValueWarning, stacklevel=4)
    capsules = numbered([c for body in sorted(parts) for c in _capsules(body, parts[body])])
    missing = {body for body in range(robot.n + 1) if body not in drawn} | {body for body, _ in unread}
    return DrawnLinks(
        capsules=capsules,
        boxes=tuple(boxes),
        ignored=_touching(robot, capsules, boxes),
        without=tuple(sorted(missing)),
    )


def _box(shape: UrdfShape, place: Array, count: int) -> Box:
    return Box(name=f"{shape.link} box {count + 1}", size=np.array(shape.size), pose=place @ shape.pose)


def _capsules(body: int, parts: list[tuple[str, Balls]]) -> list[Capsule]:
    """Capsules about the parts of a body, joined while that costs little or there are too many."""
    parts = list(parts)
    sizes = [fit_capsule(balls, polish=False).volume for _, balls in parts]
    while len(parts) > 1:
        costs = {
            (i, j): fit_capsule(parts[i][1].joined(parts[j][1]), polish=False).volume
            for i in range(len(parts))
            for j in range(i)
        }
        i, j = min(costs, key=lambda pair: costs[pair] - sizes[pair[0]] - sizes[pair[1]])
        if len(parts) <= MOST and costs[i, j] > JOIN * (sizes[i] + sizes[j]):
            break
        parts[j], sizes[j] = (parts[j][0], parts[j][1].joined(parts[i][1])), costs[i, j]
        del parts[i], sizes[i]
    spines = [(name, fit_capsule(balls)) for name, balls in parts]
    return [
        Capsule(name=name, link=body, start=spine.start, end=spine.end, radius=spine.radius, source="derived")
        for name, spine in spines
    ]


def _touching(robot: Robot, capsules: tuple[Capsule, ...], boxes: list[Box]) -> tuple[frozenset[int | str], ...]:
    """The first link and each box of the base, and those that overlap at zero or always, as between links."""
    q = np.vstack([reference_pose(robot.limits), random_poses(robot.limits, POSES)])
    poses = poses_of(robot.chain, q)
    found: set[frozenset[int | str]] = set()
    for box in boxes:
        obstacle: Obstacle = box
        found.add(frozenset((1, box.name)))
        for capsule in capsules:
            if capsule.link > 1:
                meets = Pair(first=obstacle, second=capsule).clearance(poses) < 0.0
                if meets[0] or meets.all():
                    found.add(frozenset((capsule.link, box.name)))
    return tuple(sorted(found, key=str))

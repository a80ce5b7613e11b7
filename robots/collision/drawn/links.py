"""Collision bodies of a robot from the shapes of its URDF."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from robots.collision.boxes import Box
from robots.collision.capsules import Capsule, numbered
from robots.collision.drawn.fitting import Balls, fit_capsule, shape_balls
from robots.collision.drawn.shapes import BodyPair, DrawnBodies, left_out_pairs, shapes_of
from robots.collision.pairs import SAMPLED_POSES, always_touching, body_clearance, distinct_rows, poses_of, random_poses
from robots.common.arrays import Array
from robots.common.errors import AssumedValueWarning, InputError
from robots.geometry.urdf_shapes import UrdfShape
from robots.robot import Robot


@dataclass(frozen=True, kw_only=True, eq=False)
class DrawnLinks:
    """What the shapes of a URDF make.

    Attributes:
        capsules: of the links that have shapes.
        boxes: those of the base, as they are.
        ignored: links and boxes of the base that touch by construction.
        without: links, 0 for the base, of which a shape is missing or cannot be read.
        bodies: the shapes themselves.
        joined: pairs of links whose shapes meet in nearly every pose.
        apart: pairs of links whose shapes were not seen to meet in any of many poses.
        span: lowest and highest point of the base along z of its frame [m]; None where nothing of it is drawn.
    """

    capsules: tuple[Capsule, ...]
    boxes: tuple[Box, ...]
    ignored: tuple[frozenset[int | str], ...]
    without: tuple[int, ...]
    bodies: DrawnBodies
    joined: frozenset[BodyPair]
    apart: frozenset[BodyPair]
    span: tuple[float, float] | None


# A design, its check and its campaign ask for the same robot; meshes take their time.
@lru_cache(maxsize=8)
def drawn_links(robot: Robot) -> DrawnLinks | None:
    """Fits capsules to the shapes of a robot's URDF or MJCF: of each link those for collisions, else the visual ones.

    Args:
        robot: a robot; one whose file draws nothing gives None.

    Raises:
        InputError: naming the link, on a shape that is not possible.

    Warns:
        AssumedValueWarning: naming meshes that are not found or cannot be read.
    """
    shapes = shapes_of(robot)
    if not shapes:
        return None
    parts: dict[int, list[tuple[str, Balls]]] = {}
    boxes: list[Box] = []
    unread: list[tuple[int, str]] = []
    heights: list[float] = []
    for drawn in shapes:
        name = drawn.shape.link
        try:
            balls = [part.moved(drawn.pose) for part in shape_balls(drawn.shape, robot.urdf)]
        except InputError as error:
            unread.append((drawn.body, str(error)))
            continue
        if drawn.body == 0:
            heights += [z for part in balls for z in (part.centres[:, 2] + np.outer((-1, 1), part.radii)).flat]
        if drawn.body == 0 and drawn.shape.kind == "box":
            boxes.append(_box(drawn.shape, drawn.pose, len(boxes)))
        else:
            parts.setdefault(drawn.body, []).extend((name, part) for part in balls)
    for _, text in dict.fromkeys(unread):
        warnings.warn(f"{robot.name}: {text}", AssumedValueWarning, stacklevel=4)
    capsules = numbered([c for body in sorted(parts) for c in _capsules(body, parts[body])])
    known = {*parts, *(0 for _ in boxes)}
    without = ({*range(robot.n + 1)} - known) | {body for body, _ in unread}
    bodies = DrawnBodies(shapes, robot.urdf)
    q = random_poses(robot.limits, SAMPLED_POSES)
    poses = poses_of(robot.chain, q)
    joined, apart = _met(bodies, capsules, q, poses, sorted(known - without))
    return DrawnLinks(
        capsules=capsules,
        boxes=tuple(boxes),
        ignored=(*_touching(poses, capsules, boxes), *left_out_pairs(robot)),
        without=tuple(sorted(without)),
        bodies=bodies,
        joined=joined,
        apart=apart,
        span=(float(min(heights)), float(max(heights))) if heights else None,
    )


def _met(
    bodies: DrawnBodies, capsules: tuple[Capsule, ...], q: Array, poses: Array, known: list[int]
) -> tuple[frozenset[BodyPair], frozenset[BodyPair]]:
    """Pairs of bodies whose shapes meet in nearly every pose, and those whose shapes meet in none."""
    joined, apart = set(), set()
    for pair in (frozenset((i, j)) for j in known for i in known if i < j):
        # Poses that differ by less than 0.2 rad or m in the joints between two bodies count once.
        rows = distinct_rows(q, pair, 0.2)
        near = body_clearance(capsules, pair, poses[rows]) < 0.0  # Capsules enclose the shapes.
        share = bodies.meet(pair, poses[rows][near]).sum() / len(rows)
        # Bodies whose shapes meet in more than 90 % of the poses touch by construction.
        if share > 0.9:
            joined.add(pair)
        elif share == 0.0:
            apart.add(pair)
    return frozenset(joined), frozenset(apart)


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
        # A body has at most four capsules, and two are joined where one about both is at most a tenth larger.
        if len(parts) <= 4 and costs[i, j] > 1.1 * (sizes[i] + sizes[j]):
            break
        parts[j], sizes[j] = (parts[j][0], parts[j][1].joined(parts[i][1])), costs[i, j]
        del parts[i], sizes[i]
    spines = [(name, fit_capsule(balls)) for name, balls in parts]
    return [
        Capsule(name=name, link=body, start=spine.start, end=spine.end, radius=spine.radius, source="derived")
        for name, spine in spines
    ]


def _touching(poses: Array, capsules: tuple[Capsule, ...], boxes: list[Box]) -> tuple[frozenset[int | str], ...]:
    """The first link and each box of the base, and those that always overlap, as between links."""
    found: set[frozenset[int | str]] = {frozenset((1, box.name)) for box in boxes}
    for box in boxes:
        found |= always_touching(box, capsules, poses)
    return tuple(sorted(found, key=str))

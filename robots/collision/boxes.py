"""Obstacles: boxes, planes such as the floor, and capsules, all fixed in the base frame."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from robots.collision.capsules import Capsule, frozen_vector
from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.description import CollisionDescription
from robots.geometry.chain import homogeneous, rotation_from_rpy


@dataclass(frozen=True, kw_only=True, eq=False)
class Box:
    """A box, its edges along the axes of its own frame.

    Args:
        name: what people call it.
        size: (3,) lengths of the edges [m].
        pose: (4, 4) of its centre in the base frame.

    Raises:
        InputError: naming the box, on a size or a pose that is not possible.
    """

    name: str
    size: Array
    pose: Array = field(default_factory=lambda: np.eye(4))
    link: int = field(default=0, init=False)

    def __post_init__(self) -> None:
        size, pose = frozen_vector(self.size, f"{self.name}: the size"), np.array(self.pose, dtype=np.float64)
        if not (size > 0.0).all():
            raise InputError(f"{self.name}: the size is {size} m", allowed="positive lengths")
        rotation = pose[:3, :3]
        if pose.shape != (4, 4) or not np.allclose(rotation @ rotation.T, np.eye(3), rtol=0, atol=1e-9):
            raise InputError(
                f"{self.name}: the pose is not a rotation and translation", allowed="a homogeneous matrix (4, 4)"
            )
        pose.flags.writeable = False
        object.__setattr__(self, "size", size)
        object.__setattr__(self, "pose", pose)

    @property
    def half(self) -> Array:
        """(3,) half the lengths of the edges [m]."""
        return self.size / 2.0


@dataclass(frozen=True, kw_only=True, eq=False)
class Plane:
    """A half-space that nothing may enter: free is where ``normal . x >= offset``.

    Args:
        name: what people call it.
        normal: (3,) towards the free side, in the base frame; it is normalised.
        offset: along the normal, from the base frame's origin [m].

    Raises:
        InputError: naming the plane, on a normal without length or an offset that is not finite.
    """

    name: str
    normal: Array
    offset: float
    link: int = field(default=0, init=False)

    def __post_init__(self) -> None:
        normal = np.array(frozen_vector(self.normal, f"{self.name}: the normal"))
        length = float(np.linalg.norm(normal))
        if length < 1e-9 or not np.isfinite(self.offset):
            raise InputError(f"{self.name}: normal {normal}, offset {self.offset} m", allowed="a vector, a length")
        normal = normal / length
        normal.flags.writeable = False
        object.__setattr__(self, "normal", normal)


Obstacle = Box | Plane | Capsule


FLOOR = "floor"
"""The name of a robot's floor among its obstacles."""


def floor(height: float) -> Plane:
    """Makes a floor: nothing may come below ``z = height`` [m] of the base frame."""
    return Plane(name=FLOOR, normal=np.array([0.0, 0.0, 1.0]), offset=height)


@dataclass(frozen=True, kw_only=True, eq=False)
class Scene:
    """The obstacles around a robot.

    Args:
        obstacles: boxes, planes, and capsules of link 0; each of its own name.

    Raises:
        InputError: two obstacles of one name, or a capsule that moves with a link.
    """

    obstacles: tuple[Obstacle, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "obstacles", tuple(self.obstacles))
        names = [obstacle.name for obstacle in self.obstacles]
        twice = next((name for name in names if names.count(name) > 1), None)
        if twice is not None:
            raise InputError(f"two obstacles are called {twice!r}", remedy="give each obstacle its own name")
        moving = next((obstacle for obstacle in self.obstacles if obstacle.link), None)
        if moving is not None:
            raise InputError(f"the obstacle {moving.name!r} is on link {moving.link}", allowed="link 0, the base")

    def __add__(self, other: Scene) -> Scene:
        """Puts two scenes together."""
        return Scene(obstacles=self.obstacles + other.obstacles)


def stated_scene(description: CollisionDescription) -> Scene:
    """Makes the obstacles that a robot's file states, but its floor.

    Args:
        description: the entry ``collision``.

    Raises:
        InputError: two obstacles of one name.
    """
    obstacles: list[Obstacle] = []
    for box in description.boxes:
        pose = homogeneous(rotation_from_rpy(box.rpy), box.xyz)
        obstacles.append(Box(name=box.name, size=np.array(box.size), pose=pose))
    for entry in description.capsules:
        start, end = np.array(entry.start), np.array(entry.end)
        obstacles.append(Capsule(name=entry.name, link=0, start=start, end=end, radius=entry.radius))
    return Scene(obstacles=tuple(obstacles))

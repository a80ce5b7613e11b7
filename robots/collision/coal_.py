"""The same bodies in coal, an independent judge of the distances."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from robots.collision.boxes import Box, Obstacle, Plane
from robots.collision.capsules import Capsule
from robots.collision.drawn.shapes import coal
from robots.collision.model import CollisionModel
from robots.collision.pairs import poses_of
from robots.common.arrays import Array


class CoalChecker:
    """Distances of a model's pairs by coal (formerly hpp-fcl), pair by pair and pose by pose.

    Args:
        model: the collision model.

    Raises:
        InputError: the package coal is not installed.
    """

    def __init__(self, model: CollisionModel) -> None:
        self._library = coal()
        self._model = model
        self._bodies = [(self._body(pair.first), self._body(pair.second)) for pair in model.pairs]
        self._still = [(self._moved(first), self._moved(second)) for first, second in self._bodies]

    def clearance(self, q: ArrayLike) -> Array:
        """Signed distance of every pair: minus the depth where two bodies overlap.

        Args:
            q: (N, n) [rad or m].

        Returns:
            (N, P) [m].
        """
        library, pairs = self._library, self._model.pairs
        poses = poses_of(self._model.chain, np.atleast_2d(np.asarray(q, dtype=np.float64)))
        request, result = library.DistanceRequest(), library.DistanceResult()
        clearances = np.empty((len(poses), len(pairs)))
        for column, (pair, bodies, moved) in enumerate(zip(pairs, self._bodies, self._still, strict=True)):
            places = [self._places(body, poses) for body in bodies]
            moving = [moved[0]] if pair.first.link else []
            for row in range(len(poses)):
                for transform, (rotations, shifts) in zip((*moving, moved[1]), places[-len(moving) - 1 :], strict=True):
                    transform.setRotation(rotations[row])
                    transform.setTranslation(shifts[row])
                result.clear()
                clearances[row, column] = library.distance(
                    bodies[0][0], moved[0], bodies[1][0], moved[1], request, result
                )
        return clearances

    def _body(self, body: Obstacle) -> tuple[Any, int, Array, Array]:
        """The shape, its link, and its rotation and shift in that link's frame."""
        library = self._library
        if isinstance(body, Box):
            return library.Box(*body.size), 0, body.pose[:3, :3], body.pose[:3, 3]
        if isinstance(body, Plane):
            # Coal's half-space is solid where normal . x <= offset.
            return library.Halfspace(np.array(body.normal), float(body.offset)), 0, np.eye(3), np.zeros(3)
        length = float(np.linalg.norm(body.end - body.start))
        shape = library.Capsule(body.radius, length) if length else library.Sphere(body.radius)
        return shape, body.link, _along(body), (body.start + body.end) / 2.0

    def _moved(self, body: tuple[Any, int, Array, Array]) -> Any:
        return self._library.Transform3s(np.array(body[2]), np.array(body[3]))

    def _places(self, body: tuple[Any, int, Array, Array], poses: Array) -> tuple[Array, Array]:
        _, link, rotation, shift = body
        turned = poses[:, link, :3, :3]
        return turned @ rotation, poses[:, link, :3, 3] + turned @ shift


def _along(capsule: Capsule) -> Array:
    """A rotation whose z axis runs along the spine."""
    spine = capsule.end - capsule.start
    length = float(np.linalg.norm(spine))
    if not length:
        return np.eye(3)
    z = spine / length
    x = np.cross(z, np.eye(3)[int(np.argmin(np.abs(z)))])
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])

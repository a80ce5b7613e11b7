"""How far bodies can move against each other between two samples of a motion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robots.collision.model import CollisionModel
from robots.collision.pairs import Pair
from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.signals import Motion


@dataclass(frozen=True, eq=False)
class Pieces:
    """Pieces of a path, a cubic each.

    Attributes:
        control: Bezier points (M, 4, n) [rad or m].
        begin: (M,) [s].
        length: (M,) [s].
    """

    control: Array
    begin: Array
    length: Array

    def rows(self, part: NDArray[np.bool_]) -> Pieces:
        """Keeps some of the pieces."""
        return Pieces(self.control[part], self.begin[part], self.length[part])

    def travel(self) -> Array:
        """Bounds what each joint covers on a piece (M, n): a cubic is no longer than its Bezier polygon."""
        return np.abs(np.diff(self.control, axis=1)).sum(axis=1)

    def halves(self) -> Pieces:
        """Splits every piece in its middle (de Casteljau), left and right in turn."""
        first = (self.control[:, 1:] + self.control[:, :-1]) / 2.0
        second = (first[:, 1:] + first[:, :-1]) / 2.0
        middle = (second[:, 1] + second[:, 0]) / 2.0
        left = np.stack([self.control[:, 0], first[:, 0], second[:, 0], middle], axis=1)
        right = np.stack([middle, second[:, 1], first[:, 2], self.control[:, 3]], axis=1)
        half = self.length / 2.0
        return Pieces(
            np.stack([left, right], axis=1).reshape(-1, *self.control.shape[1:]),
            np.column_stack([self.begin, self.begin + half]).reshape(-1),
            np.repeat(half, 2),
        )


def pieces_of(motion: Motion) -> Pieces:
    """Lays a cubic through the positions and velocities of neighbouring samples: N - 1 pieces."""
    h, q, dq = np.diff(motion.t)[:, None], motion.q, motion.dq
    control = np.stack([q[:-1], q[:-1] + h * dq[:-1] / 3.0, q[1:] - h * dq[1:] / 3.0, q[1:]], axis=1)
    return Pieces(control, motion.t[:-1], h[:, 0])


def reach_of_pairs(model: CollisionModel, pieces: Pieces) -> Array:
    """Bounds how far each pair's bodies move against each other per unit of each joint.

    Args:
        model: the collision model.
        pieces: the path, which says how far prismatic joints carry what comes after them.

    Returns:
        (P, n) [m/rad or m/m].
    """
    extents = np.abs(pieces.control).max(axis=(0, 1), initial=0.0)
    rows = [_reach(model, pair, extents) for pair in model.pairs]
    return np.array(rows).reshape(len(rows), model.chain.n)


def _reach(model: CollisionModel, pair: Pair, extents: Array) -> Array:
    """Farthest that the second body's spine ever is from the axis of each joint between the bodies.

    The distance of the next joint's origin (or of the spine's end itself) from the axis, then all lengths beyond it.
    """
    chain, second = model.chain, pair.second
    ends = np.array([second.start, second.end])
    reach = np.zeros(chain.n)
    for j in pair.joints:
        axis = chain.joints[j].axis
        if chain.kinds[j] == "prismatic":
            reach[j] = 1.0
        elif second.link == j + 1:
            reach[j] = np.linalg.norm(np.cross(axis, ends), axis=1).max()
        else:
            reach[j] = np.linalg.norm(ends, axis=1).max()
            for k in range(j + 1, second.link):
                vector = chain.joints[k].translation
                # Of the first length, what lies along the axis does not count.
                reach[j] += np.linalg.norm(np.cross(axis, vector) if k == j + 1 else vector)
                reach[j] += extents[k] if chain.kinds[k] == "prismatic" else 0.0
    return reach


def travel_bound(model: CollisionModel, motion: Motion) -> Array:
    """Bounds how far the bodies of each pair can move against each other between two samples.

    ``sum over joints of reach * length``, the length being that of the Bezier polygon of the joint's cubic through
    positions and velocities. A clearance of c0 and c1 at the samples is at least (c0 + c1 - bound) / 2 between them.

    Args:
        model: the collision model.
        motion: N samples.

    Returns:
        (N - 1, P) [m].

    Raises:
        InputError: a motion of another number of joints.
    """
    require_joints(model, motion)
    pieces = pieces_of(motion)
    return pieces.travel() @ reach_of_pairs(model, pieces).T


def require_joints(model: CollisionModel, motion: Motion) -> None:
    """Refuses a motion of another robot.

    Raises:
        InputError: another number of joints.
    """
    if motion.n != model.chain.n:
        raise InputError(f"the motion has {motion.n} joints", allowed=f"{model.chain.n}, as the collision model")

"""Pairs of bodies that can collide, without neighbours and pairs that touch by construction."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robots.collision import exact
from robots.collision.boxes import Box, Obstacle, Plane
from robots.collision.capsules import Capsule
from robots.common.arrays import Array
from robots.geometry.chain import Chain
from robots.limits import Limits

SAMPLED_POSES = 1000  # of which a pair must leave one free to be worth watching
TOUCHING_DISTANCE = 0.015  # m; bodies that no pose takes farther apart touch by construction


@dataclass(frozen=True, kw_only=True, eq=False)
class Pair:
    """Two bodies that must not meet.

    Attributes:
        first: a capsule of a link, or an obstacle.
        second: a capsule of a link farther out; the joints between the two move them against each other.
    """

    first: Obstacle
    second: Capsule

    @property
    def name(self) -> str:
        """Names both, such as "base / upper arm"."""
        return f"{self.first.name} / {self.second.name}"

    @property
    def joints(self) -> range:
        """The joints, counted from 0, that move the bodies against each other."""
        return range(self.first.link, self.second.link)

    @property
    def radii(self) -> float:
        """Sum of the radii [m]; a box and a plane have none."""
        return self.second.radius + (self.first.radius if isinstance(self.first, Capsule) else 0.0)

    def clearance(self, poses: Array) -> Array:
        """Exact clearance: negative by the depth of the radii's overlap when they meet.

        Args:
            poses: (N, n + 1, 4, 4) of the base and the links.

        Returns:
            (N,) [m].
        """
        return clearances([self], poses)[:, 0]

    def _between(self, place: Callable[[Capsule], tuple[Array, Array]]) -> Array:
        """The clearance from where the spines' ends are."""
        b0, b1 = place(self.second)
        if isinstance(self.first, Plane):
            return exact.segment_plane(b0, b1, self.first.normal, self.first.offset) - self.radii
        if isinstance(self.first, Box):
            rotation, centre = self.first.pose[:3, :3], self.first.pose[:3, 3]
            distance = exact.segment_box((b0 - centre) @ rotation, (b1 - centre) @ rotation, self.first.half)
        else:
            distance = exact.segment_segment(*place(self.first), b0, b1)
        return distance - self.radii


def clearances(pairs: Sequence[Pair], poses: Array) -> Array:
    """Exact clearances of pairs, the spine of each capsule placed once.

    Args:
        pairs: P of them.
        poses: (N, n + 1, 4, 4) of the base and the links.

    Returns:
        (N, P) [m].
    """
    placed: dict[int, tuple[Array, Array]] = {}

    def place(capsule: Capsule) -> tuple[Array, Array]:
        if id(capsule) not in placed:
            placed[id(capsule)] = spine(capsule, poses)
        return placed[id(capsule)]

    columns = [pair._between(place) for pair in pairs]
    return np.column_stack(columns) if columns else np.empty((len(poses), 0))


def spine(capsule: Capsule, poses: Array) -> tuple[Array, Array]:
    """Places the ends of a capsule's spine in the base frame: (N, 3) each [m], from poses (N, n + 1, 4, 4)."""
    pose = np.ascontiguousarray(poses[:, capsule.link, :3, :])
    ends = np.ones((4, 2))
    ends[:3] = np.column_stack([capsule.start, capsule.end])
    # One product of large matrices, not N of small ones.
    placed = (pose.reshape(-1, 4) @ ends).reshape(len(pose), 3, 2)
    return placed[:, :, 0], placed[:, :, 1]


def poses_of(chain: Chain, q: Array) -> Array:
    """Poses (N, n + 1, 4, 4) of the base and all links at q (N, n)."""
    base = np.broadcast_to(np.eye(4), (len(q), 1, 4, 4))
    return np.concatenate([base, chain.transforms(q)], axis=1)


def random_poses(limits: Limits, count: int, seed: int = 0) -> Array:
    """Draws poses (count, n) between the limits; an open end counts as half a turn, or a metre, from the other."""
    lower = np.where(np.isfinite(limits.lower), limits.lower, np.minimum(limits.upper, np.pi) - 2 * np.pi)
    lower = np.where(np.isfinite(lower), lower, -np.pi)
    upper = np.where(np.isfinite(limits.upper), limits.upper, lower + 2 * np.pi)
    return np.random.default_rng(seed).uniform(lower, upper, (count, limits.n))


def sampled_poses(chain: Chain, limits: Limits) -> Array:
    """Poses (N, n + 1, 4, 4) of the base and the links, by which pairs that always touch are found."""
    return poses_of(chain, random_poses(limits, SAMPLED_POSES))


def distinct_rows(q: Array, bodies: frozenset[int], cell: float) -> NDArray[np.intp]:
    """Rows of q (N, n) that differ in a joint between two bodies by more than a cell's size [rad or m], in order."""
    low, high = sorted(bodies)
    return np.sort(np.unique(np.round(q[:, low:high] / cell), axis=0, return_index=True)[1])


def body_clearance(capsules: Sequence[Capsule], bodies: frozenset[int], poses: Array) -> Array:
    """Smallest clearance between the capsules of two bodies (N,) [m]; infinite where one has none."""
    low, high = sorted(bodies)
    pairs = [Pair(first=a, second=b) for a in capsules if a.link == low for b in capsules if b.link == high]
    return clearances(pairs, poses).min(axis=1, initial=np.inf)


def always_touching(obstacle: Obstacle, capsules: Sequence[Capsule], poses: Array) -> set[frozenset[int | str]]:
    """Links, with the name of an obstacle, that a capsule of theirs touches in every pose."""
    return {
        frozenset((capsule.link, obstacle.name))
        for capsule in capsules
        if capsule.link and (Pair(first=obstacle, second=capsule).clearance(poses) < TOUCHING_DISTANCE).all()
    }


def choose_pairs(
    chain: Chain,
    limits: Limits,
    capsules: Sequence[Capsule],
    obstacles: Sequence[Obstacle],
    ignored: Collection[frozenset[int | str]] = (),
    apart: Collection[frozenset[int]] = (),
) -> tuple[tuple[Pair, ...], tuple[tuple[str, str], ...]]:
    """Lists the pairs to watch, and why the others are not.

    Left out are capsules of one link and of neighbouring links, pairs to be ignored, and pairs of links that touch in
    all of many random poses, by construction, as planners assume (MoveIt's always colliding pairs). Where drawn shapes
    never meet but their capsules often do, the capsules are too coarse to judge. A pair of a link and an
    obstacle is never left out automatically.

    Args:
        chain: the chain.
        limits: of the joints.
        capsules: of the links.
        obstacles: in the base frame.
        ignored: pairs of link numbers, or of a link number and an obstacle's name.
        apart: pairs of links whose drawn shapes were not seen to meet.

    Returns:
        The pairs, and the name and the reason of each pair of links left out.
    """
    pairs = [
        Pair(first=first, second=second) for first in capsules for second in capsules if second.link > first.link + 1
    ]
    poses = sampled_poses(chain, limits)
    kept: list[Pair] = []
    excluded: list[tuple[str, str]] = []
    for pair, share in zip(pairs, (clearances(pairs, poses) < TOUCHING_DISTANCE).mean(axis=0), strict=True):
        bodies = frozenset((pair.first.link, pair.second.link))
        if bodies in ignored:
            excluded.append((pair.name, "to be ignored"))
        elif share == 1.0:
            excluded.append((pair.name, "touch in every pose"))
        # Capsules that are near in more than a quarter of the poses would take too much of the free space.
        elif bodies in apart and share > 0.25:
            excluded.append((pair.name, "the drawn shapes do not meet, only the capsules about them"))
        else:
            kept.append(pair)
    for obstacle in obstacles:
        for capsule in capsules:
            pair = Pair(first=obstacle, second=capsule)
            if capsule.link == 0:
                continue  # both are fixed
            if frozenset((capsule.link, obstacle.name)) in ignored:
                excluded.append((pair.name, "to be ignored"))
            else:
                kept.append(pair)
    return tuple(kept), tuple(excluded)

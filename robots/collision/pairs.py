"""Pairs of bodies that can collide, without neighbours and pairs that touch by construction."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robots.collision import exact
from robots.collision.boxes import Box, Obstacle, Plane
from robots.collision.capsules import Capsule
from robots.geometry.chain import Chain
from robots.limits import Limits

Array = NDArray[np.float64]

POSES = 1000  # of which a pair must leave one free to be worth watching
SEED = 0


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
        b0, b1 = spine(self.second, poses)
        if isinstance(self.first, Plane):
            return exact.segment_plane(b0, b1, self.first.normal, self.first.offset) - self.radii
        if isinstance(self.first, Box):
            rotation, centre = self.first.pose[:3, :3], self.first.pose[:3, 3]
            distance = exact.segment_box((b0 - centre) @ rotation, (b1 - centre) @ rotation, self.first.half)
        else:
            distance = exact.segment_segment(*spine(self.first, poses), b0, b1)
        return distance - self.radii


def spine(capsule: Capsule, poses: Array) -> tuple[Array, Array]:
    """Places the ends of a capsule's spine in the base frame: (N, 3) each [m], from poses (N, n + 1, 4, 4)."""
    rotation, origin = poses[:, capsule.link, :3, :3], poses[:, capsule.link, :3, 3]
    return origin + rotation @ capsule.start, origin + rotation @ capsule.end


def poses_of(chain: Chain, q: Array) -> Array:
    """Poses (N, n + 1, 4, 4) of the base and all links at q (N, n)."""
    base = np.broadcast_to(np.eye(4), (len(q), 1, 4, 4))
    return np.concatenate([base, chain.transforms(q)], axis=1)


def reference_pose(limits: Limits) -> Array:
    """The pose zero, moved within the limits where it is outside of them (n,) [rad or m]."""
    return np.clip(np.zeros(limits.n), limits.lower, limits.upper)


def random_poses(limits: Limits, count: int, seed: int = SEED) -> Array:
    """Draws poses (count, n) between the limits; an open end counts as half a turn, or a metre, from the other."""
    lower = np.where(np.isfinite(limits.lower), limits.lower, np.minimum(limits.upper, np.pi) - 2 * np.pi)
    lower = np.where(np.isfinite(lower), lower, -np.pi)
    upper = np.where(np.isfinite(limits.upper), limits.upper, lower + 2 * np.pi)
    return np.random.default_rng(seed).uniform(lower, upper, (count, limits.n))


def choose_pairs(
    chain: Chain,
    limits: Limits,
    capsules: Sequence[Capsule],
    obstacles: Sequence[Obstacle],
    ignored: Collection[frozenset[int | str]] = (),
) -> tuple[tuple[Pair, ...], tuple[tuple[str, str], ...]]:
    """Lists the pairs to watch, and why the others are not.

    Left out are capsules of one link and of neighbouring links, and pairs to be ignored. Pairs of links that overlap at
    pose zero, or in all of many random poses, are left out as well: they touch by construction, as planners assume
    (MoveIt's default and always colliding pairs). A pair of a link and an obstacle is never left out automatically.

    Args:
        chain: the chain.
        limits: of the joints.
        capsules: of the links.
        obstacles: in the base frame.
        ignored: pairs of link numbers, or of a link number and an obstacle's name.

    Returns:
        The pairs, and the name and the reason of each pair of links left out.
    """
    pairs = [
        Pair(first=first, second=second) for first in capsules for second in capsules if second.link > first.link + 1
    ]
    q = np.vstack([reference_pose(limits), random_poses(limits, POSES)])
    poses = poses_of(chain, q)
    kept: list[Pair] = []
    excluded: list[tuple[str, str]] = []
    for pair in pairs:
        meets = pair.clearance(poses) < 0.0
        if frozenset((pair.first.link, pair.second.link)) in ignored:
            excluded.append((pair.name, "to be ignored"))
        elif meets.all():
            excluded.append((pair.name, "overlap in every pose"))
        elif meets[0]:
            excluded.append((pair.name, "overlap at the pose zero"))
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

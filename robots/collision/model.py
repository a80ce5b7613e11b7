"""The collision model of a robot: capsules on its links, obstacles around it, and the pairs that must not meet."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection
from dataclasses import dataclass, field, fields
from functools import cached_property

import casadi
import numpy as np
from numpy.typing import ArrayLike

from robots.batch import BatchFunction, batch_function
from robots.collision import distance
from robots.collision.boxes import Box, Obstacle, Plane, Scene
from robots.collision.capsules import Capsule, link_name
from robots.collision.distance import Contact, Segment
from robots.collision.drawn.shapes import DrawnBodies
from robots.collision.kinematics import Frames, symbolic_frames
from robots.collision.pairs import Pair, choose_pairs, clearances, poses_of
from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.geometry.chain import Chain
from robots.limits import Limits

SMOOTHING = 0.002
"""Default of how much too small a smooth clearance may be [m]."""


@dataclass(frozen=True, kw_only=True, eq=False)
class CollisionModel:
    """Capsules of the links against each other and against obstacles.

    Args:
        name: of the robot.
        chain: its kinematic chain.
        limits: of its joints, from which the pairs' reasons and the travel of prismatic joints come.
        capsules: of the links; link 0 is the base.
        scene: the obstacles.
        ignored: pairs that may touch: of link numbers, or of a link number and an obstacle's name.
        apart: pairs of link numbers whose drawn shapes were not seen to meet.
        bodies: the drawn shapes themselves, where a file has them.
        smoothing: how much too small a smooth clearance may be [m]; more of it makes the solver's way smoother.

    Attributes:
        pairs: the P pairs to be watched, the links' first.
        excluded: names of the pairs of links that are not, with the reason.
        by_shape: pairs of link numbers that drawn shapes have to judge, for capsules cannot.

    Raises:
        InputError: a capsule on a link that the chain has not, two bodies of one name, a pair to be ignored that does
            not exist, or a smoothing that is not positive and less than every radius.
    """

    name: str
    chain: Chain
    limits: Limits
    capsules: tuple[Capsule, ...]
    scene: Scene = field(default_factory=Scene)
    ignored: Collection[frozenset[int | str]] = ()
    apart: Collection[frozenset[int]] = ()
    bodies: DrawnBodies | None = None
    smoothing: float = SMOOTHING
    pairs: tuple[Pair, ...] = field(init=False)
    excluded: tuple[tuple[str, str], ...] = field(init=False)
    by_shape: tuple[frozenset[int], ...] = field(init=False)

    def __post_init__(self) -> None:
        set_, n = object.__setattr__, self.chain.n
        set_(self, "capsules", tuple(self.capsules))
        set_(self, "ignored", tuple(frozenset(pair) for pair in self.ignored))
        for capsule in self.capsules:
            if capsule.link > n:
                raise InputError(f"{capsule.name}: on link {capsule.link}", allowed=f"0 (the base) to {n}")
        names = [body.name for body in (*self.capsules, *self.scene.obstacles)]
        twice = next((name for name in names if names.count(name) > 1), None)
        if twice is not None:
            raise InputError(f"two bodies are called {twice!r}", remedy="give each its own name")
        known = {*range(n + 1), *(obstacle.name for obstacle in self.scene.obstacles)}
        for pair in self.ignored:
            unknown = sorted(str(member) for member in pair - known)
            if unknown or len(pair) != 2:
                problem = f"a pair to be ignored of {', '.join(map(repr, sorted(pair, key=str)))}"
                raise InputError(problem, allowed=f"two of {', '.join(map(str, sorted(known, key=str)))}")
        thinnest = min((capsule.radius for capsule in self.capsules), default=np.inf)
        if not 0.0 < self.smoothing < thinnest:
            raise InputError(f"a smoothing of {self.smoothing} m", allowed=f"more than 0, less than {thinnest:g} m")
        pairs, excluded = choose_pairs(self.chain, self.limits, self.capsules, self.obstacles, self.ignored, self.apart)
        set_(self, "pairs", pairs)
        set_(self, "excluded", excluded)
        set_(self, "by_shape", self._by_shape())

    def _by_shape(self) -> tuple[frozenset[int], ...]:
        """Pairs of links with drawn shapes that not all of their capsules watch, but neighbours that never meet."""
        drawn = sorted(self.bodies.bodies) if self.bodies is not None else []
        capsules, own = Counter(capsule.link for capsule in self.capsules), set(map(id, self.capsules))
        watched = Counter(
            frozenset((pair.first.link, pair.second.link)) for pair in self.pairs if id(pair.first) in own
        )
        pairs = (frozenset((i, j)) for j in drawn for i in drawn if i < j)
        return tuple(
            pair
            for pair in pairs
            if pair not in self.ignored
            and watched[pair] < np.prod([capsules[i] for i in pair])
            and not (pair in self.apart and max(pair) - min(pair) == 1)
        )

    @property
    def obstacles(self) -> tuple[Obstacle, ...]:
        """The obstacles of the scene."""
        return self.scene.obstacles

    @property
    def names(self) -> tuple[str, ...]:
        """The pairs' names (P,)."""
        return tuple(pair.name for pair in self.pairs)

    @property
    def assumed(self) -> tuple[str, ...]:
        """Names of the capsules that no source backs."""
        return tuple(capsule.name for capsule in self.capsules if capsule.source == "assumed")

    def clearance(self, q: ArrayLike) -> Array:
        """Exact clearance of every pair: below zero where two bodies overlap.

        Args:
            q: (N, n) [rad or m].

        Returns:
            (N, P) [m].
        """
        return clearances(self.pairs, poses_of(self.chain, np.atleast_2d(np.asarray(q, dtype=np.float64))))

    def smooth_clearance(self, q: ArrayLike) -> tuple[Array, Array]:
        """Smooth clearances, at most `smoothing` below the exact ones of free pairs, and their exact gradients.

        Args:
            q: (N, n) [rad or m].

        Returns:
            (N, P) [m] and (N, P, n) [m/rad or m/m].
        """
        rows = np.atleast_2d(np.asarray(q, dtype=np.float64))
        if not self.pairs:
            return np.empty((len(rows), 0)), np.empty((len(rows), 0, self.chain.n))
        values, gradients = self._batch(rows)
        return values[:, :, 0], gradients

    @cached_property
    def _batch(self) -> BatchFunction:
        return batch_function(self.symbolic())

    def symbolic(self) -> casadi.Function:
        """Builds q (n) -> smooth clearances (P, 1) and their gradients (P, n) as a CasADi function."""
        frames = symbolic_frames(self.chain)
        return casadi.Function("clearance", [frames.q], list(self.expression(frames)), ["q"], ["h", "gradient"])

    def expression(self, frames: Frames) -> tuple[casadi.SX, casadi.SX]:
        """Writes the smooth clearances (P, 1) and their gradients (P, n) over a chain's frames."""
        spines = {id(c): (frames.point(c.link, c.start), frames.point(c.link, c.end)) for c in self.capsules}
        values, gradients = casadi.SX(len(self.pairs), 1), casadi.SX(len(self.pairs), self.chain.n)
        for row, pair in enumerate(self.pairs):
            contact = self._contact(pair, spines)
            values[row] = contact.clearance
            for joint in pair.joints:
                gradients[row, joint] = casadi.dot(contact.direction, frames.shift(joint, contact.point))
        return values, gradients

    def _contact(self, pair: Pair, spines: dict[int, Segment]) -> Contact:
        first, second = pair.first, pair.second
        moving, sphere, rho, c = spines[id(second)], second.is_sphere, pair.radii, self.smoothing
        if isinstance(first, Plane):
            return distance.segment_plane(moving, sphere, first.normal, first.offset, rho, c)
        if isinstance(first, Box):
            return distance.segment_box(moving, sphere, first.pose, first.half, rho, c)
        fixed = spines.get(id(first)) or (casadi.SX(first.start), casadi.SX(first.end))
        return distance.segment_segment(fixed, moving, (first.is_sphere, sphere), rho, c)

    def summary(self) -> str:
        """Lists the capsules, the obstacles, the pairs watched and those left out with their reasons."""
        lines = [f"{self.name}: {len(self.capsules)} capsules, {len(self.obstacles)} obstacles"]
        for capsule in self.capsules:
            length = np.linalg.norm(capsule.end - capsule.start)
            origin = f", {capsule.source}" if capsule.source else ""
            lines.append(
                f"  {capsule.name}: on {'the base' if capsule.link == 0 else f'link {capsule.link}'},"
                f" radius {1e3 * capsule.radius:.0f} mm, spine {1e3 * length:.0f} mm{origin}"
            )
        lines += [f"  {obstacle.name}: {type(obstacle).__name__.lower()}" for obstacle in self.obstacles]
        lines += [f"{len(self.pairs)} pairs checked: {', '.join(self.names) or 'none'}"]
        lines += [f"not checked: {name} ({reason})" for name, reason in self.excluded]
        if self.by_shape:
            lines += [f"judged by the drawn shapes at samples: {', '.join(map(body_names, self.by_shape))}"]
        else:
            lines += ["not checked: bodies of one link and of neighbouring links"]
        return "\n".join(lines)

    def __getstate__(self) -> dict[str, object]:
        # Compiled code is rebuilt in the process that needs it.
        return {item.name: getattr(self, item.name) for item in fields(self)}

    def __setstate__(self, state: dict[str, object]) -> None:
        self.__dict__.update(state)


def body_names(pair: frozenset[int]) -> str:
    """Names two bodies, such as "link 2 / link 5"."""
    return " / ".join(map(link_name, sorted(pair)))

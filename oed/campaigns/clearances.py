"""Keeps stages free of collisions: ranges in which all poses are free, stretches of one joint, moves around bodies."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.stats import qmc

from robots.collision import CollisionModel, check_motion
from robots.common.arrays import Array
from robots.limits import Limits
from robots.signals import Motion


class CollisionFreeRanges:
    """Finds room for motions of one robot.

    Args:
        model: bodies and obstacles.
        home: pose (n,) [rad or m] that is free, by at least the clearance asked for or else by half its own.
        clearance: that sampled poses keep [m].
    """

    def __init__(self, model: CollisionModel, home: Array, clearance: float = 0.01) -> None:
        self._model, self._home = model, np.asarray(home, dtype=np.float64)
        own = float(model.clearance(self._home).min(initial=np.inf))
        self.possible = bool(model.pairs) and own > 0.0
        self._margin = min(clearance, own / 2.0)

    def free(self, motion: Motion) -> bool:
        """Whether a motion is proved free of collisions at all times."""
        return check_motion(self._model, motion, confirm=False).certified

    def clear(self, poses: Array) -> NDArray[np.bool_]:
        """Which poses (M, n) keep the clearance (M,)."""
        kept: NDArray[np.bool_] = self._model.clearance(poses).min(axis=1, initial=np.inf) >= self._margin
        return kept

    def box(self, limits: Limits, fraction: float, seed: int = 0) -> Limits:
        """Trims the ranges until all poses in them are free, home among them.

        The box is peeled (Friedman and Fisher 1999): again and again the side is trimmed that holds the largest share
        of colliding poses, so that joints which never collide keep their range. It is a box: every straight move
        between two of its poses stays inside.

        Args:
            limits: of the joints.
            fraction: part of each range to begin with, about its middle; an endless joint's range is one turn.
            seed: of the sampled poses.

        Returns:
            The limits with the ranges of the box.
        """
        lower, upper = self._ranges(limits, fraction)
        rng = np.random.default_rng(seed)
        # Part of the way from the end of a range to home by which it is trimmed at least.
        grid = np.linspace(0.0, 1.0, round(1.0 / 0.025) + 1)[1:-1]
        q, hits = self._draw(lower, upper, rng)
        # More cuts than this leave hardly any room.
        for _ in range(200):
            if not hits.any():
                break
            inside = self._trimmed(q, hits, lower, upper, grid)
            q, hits = q[inside], hits[inside]
            # New poses are drawn when fewer than half are left.
            if len(q) < 4096 or not hits.any():
                q, hits = self._draw(lower, upper, rng)
        return replace(limits, lower=lower, upper=upper)

    def _ranges(self, limits: Limits, fraction: float) -> tuple[Array, Array]:
        endless = ~np.isfinite(limits.upper - limits.lower)
        middle = np.where(endless, self._home, limits.middle)
        half = np.where(endless, np.pi, (limits.upper - limits.lower) / 2.0) * fraction
        return np.minimum(middle - half, self._home), np.maximum(middle + half, self._home)

    def _draw(self, lower: Array, upper: Array, rng: np.random.Generator) -> tuple[Array, NDArray[np.bool_]]:
        # A power of two, to be even.
        unit = qmc.Sobol(lower.size, rng=rng).random(8192)
        # A third of the samples on each side's face: corners are where folded arms meet themselves.
        edge = rng.random(unit.shape)
        unit = np.where(edge < 1 / 6, 0.0, np.where(edge > 5 / 6, 1.0, unit))
        q = lower + unit * (upper - lower)
        return q, ~self.clear(q)

    def _trimmed(self, q: Array, hits: NDArray[np.bool_], lower: Array, upper: Array, grid: Array) -> NDArray[np.bool_]:
        """Cuts one side in place, where that lowers the rate of collisions most for the room it costs."""
        before = np.log((hits.sum() + 0.5) / (len(q) + 1.0))
        best, side = -np.inf, (lower, 0, lower[0])
        for joint in range(lower.size):
            # In the order of the joint's values, so that what remains of a cut is the end of the list.
            order = q[:, joint].argsort()
            values, tail = q[order, joint], np.cumsum(hits[order][::-1])[::-1]
            for bound, sign in ((lower, 1.0), (upper, -1.0)):
                cuts = bound[joint] + grid * (self._home[joint] - bound[joint])
                first = np.searchsorted(values, cuts, side="left" if sign > 0 else "right")
                count = len(q) - first if sign > 0 else first
                left = np.append(tail, 0)[first]
                left = left if sign > 0 else tail[0] - left
                room = 1.0 - sign * (cuts - bound[joint]) / (upper[joint] - lower[joint])
                with np.errstate(divide="ignore", invalid="ignore"):
                    score = (before - np.log((left + 0.5) / (count + 1.0))) / -np.log(room)
                score = np.where((left < tail[0]) & (room < 1.0), score, -np.inf)
                if score.max() > best:
                    best, side = float(score.max()), (bound, joint, float(cuts[score.argmax()]))
        bound, joint, cut = side
        bound[joint] = cut
        inside: NDArray[np.bool_] = (q[:, joint] >= lower[joint]) & (q[:, joint] <= upper[joint])
        return inside

    def stretch(self, limits: Limits, joint: int, pose: Array) -> tuple[float, float]:
        """Finds how far one joint can go from a pose, all others holding, before a body comes too close.

        Args:
            limits: of the joints.
            joint: counted from 1.
            pose: (n,) [rad or m].

        Returns:
            The ends of the longest free stretch; of no length at the pose where nothing is free.
        """
        lower, upper = self._ranges(limits, 1.0)
        # Positions of a joint at which a stretch is looked at.
        steps = 181
        positions = np.linspace(lower[joint - 1], upper[joint - 1], steps)
        poses = np.tile(pose, (steps, 1))
        poses[:, joint - 1] = positions
        edges = np.flatnonzero(np.diff(np.concatenate([[0], self.clear(poses).astype(int), [0]])))
        if not edges.size:
            return float(pose[joint - 1]), float(pose[joint - 1])
        starts, stops = edges[::2], edges[1::2] - 1
        longest = int((stops - starts).argmax())
        return float(positions[starts[longest]]), float(positions[stops[longest]])

    def ways(self, start: Array, end: Array) -> Iterator[tuple[Array, ...]]:
        """Lists ways between two poses, the straight one first: the poses at which each stops."""
        yield start, end
        yield start, self._home, end
        outward = range(start.size)
        for order in (outward, outward[::-1]):
            yield tuple(_one_by_one(start, end, order))
            folded = _one_by_one(start, self._home, order)
            yield (*folded, *_one_by_one(self._home, end, order[::-1])[1:])


def _one_by_one(start: Array, end: Array, order: Sequence[int]) -> list[Array]:
    """Moves the joints from one pose to the other in turn."""
    poses = [start]
    for joint in order:
        if start[joint] != end[joint]:
            pose = poses[-1].copy()
            pose[joint] = end[joint]
            poses.append(pose)
    return poses

"""Collisions along a motion, also between its samples: conservative advancement on all intervals at once."""

from __future__ import annotations

import numpy as np

from robots.collision.model import CollisionModel, body_names
from robots.collision.pairs import body_clearance, distinct_rows, poses_of
from robots.collision.report import CollisionReport
from robots.collision.travel import pieces_of, reach_of_pairs, require_joints
from robots.common.arrays import Array
from robots.signals import Motion

SAMPLES_AT_A_TIME = 8192  # samples at a time: hours at 4 ms must not fill the memory


def check_motion(
    model: CollisionModel,
    motion: Motion,
    *,
    margin: float = 0.0,
    confirm: bool = True,
    max_halvings: int = 16,
) -> CollisionReport:
    """Checks a motion for all times: every interval is halved until it is proved free, or found not to be.

    Between two samples the motion is taken as the cubic through their positions and velocities. It differs from a
    motion of jerk j by less than j h^3 / 50: at h = 4 ms and 640 rad/s3 by a microradian.

    Pairs of links that capsules cannot judge, such as neighbours, are looked at by their drawn shapes, at samples only.

    Args:
        model: the collision model.
        motion: N samples, such as a trajectory at the controller's period.
        margin: the clearance that every pair must keep [m].
        confirm: have coal compute the clearances at all samples too.
        max_halvings: of an interval before it counts as undecided.

    Returns:
        The report.

    Raises:
        InputError: a motion of another number of joints, or coal not installed.
    """
    require_joints(model, motion)
    search, meetings = _Search(model, margin, max_halvings), _meetings(model, motion)
    difference = 0.0 if confirm else None
    for start in range(0, max(1, len(motion) - 1), SAMPLES_AT_A_TIME - 1):
        block = motion.slice(start, min(start + SAMPLES_AT_A_TIME, len(motion)))
        sampled = search.block(block)
        if difference is not None:
            difference = max(difference, _disagreement(model, block, sampled))
    return CollisionReport(
        names=model.names,
        clearance=search.smallest,
        time=search.times,
        lower_bound=np.minimum(search.proved, search.smallest),
        margin=margin,
        certified=search.decided and bool((search.smallest >= margin).all()) and not meetings,
        evaluations=search.evaluations,
        disagreement=difference,
        by_shape=tuple(map(body_names, model.by_shape)),
        meetings=meetings,
    )


def _meetings(model: CollisionModel, motion: Motion) -> tuple[tuple[str, float], ...]:
    """The pairs whose drawn shapes meet, and when first [s]."""
    found = []
    for pair in model.by_shape:
        # Drawn shapes are checked once for all samples within 0.02 rad or m of each joint.
        rows = distinct_rows(motion.q, pair, 0.02)
        poses = poses_of(model.chain, motion.q[rows])
        near = body_clearance(model.capsules, pair, poses) < 0.0  # Capsules enclose the shapes.
        assert model.bodies is not None
        met = np.flatnonzero(near)[model.bodies.meet(pair, poses[near])]
        if met.size:
            found.append((body_names(pair), float(motion.t[rows[met[0]]])))
    return tuple(found)


class _Search:
    """The bounds of each pair so far."""

    def __init__(self, model: CollisionModel, margin: float, max_halvings: int) -> None:
        pairs = len(model.pairs)
        self._model, self._margin, self._max_halvings = model, margin, max_halvings
        self.smallest, self.proved = np.full(pairs, np.inf), np.full(pairs, np.inf)
        self.times = np.full(pairs, np.nan)
        self.decided, self.evaluations = True, 0

    def block(self, motion: Motion) -> Array:
        """Searches one stretch of the motion; returns the clearances at its samples (N, P)."""
        sampled = self._look(motion.q, motion.t)
        pieces, ends = pieces_of(motion), np.stack([sampled[:-1], sampled[1:]], axis=1)
        reach = reach_of_pairs(self._model, pieces)
        for level in range(self._max_halvings + 1):
            bounds = (ends.sum(axis=1) - pieces.travel() @ reach.T) / 2.0
            # A pair that was found below the margin needs no proof of the opposite.
            open_ = ((bounds < self._margin) & (self.smallest >= self._margin)).any(axis=1)
            last = level == self._max_halvings
            settled = bounds if last else bounds[~open_]
            self.proved = np.minimum(self.proved, settled.min(axis=0, initial=np.inf))
            if last or not open_.any():
                self.decided &= not open_.any()
                break
            ends, pieces = ends[open_], pieces.rows(open_).halves()
            middle = self._look(pieces.control[1::2, 0], pieces.begin[1::2])
            ends = np.stack([ends[:, 0], middle, middle, ends[:, 1]], axis=1).reshape(-1, 2, middle.shape[1])
        return sampled

    def _look(self, q: Array, t: Array) -> Array:
        clearance = self._model.clearance(q)
        self.evaluations += len(q)
        if clearance.size:
            row = clearance.argmin(axis=0)
            lowest = clearance.min(axis=0)
            self.times = np.where(lowest < self.smallest, t[row], self.times)
            self.smallest = np.minimum(self.smallest, lowest)
        return clearance


def _disagreement(model: CollisionModel, motion: Motion, sampled: Array) -> float:
    """Largest difference to coal [m]; depths of overlaps do not count, because coal defines them differently."""
    from robots.collision.coal_ import CoalChecker

    other = CoalChecker(model).clearance(motion.q)
    free = (sampled > 0.0) | (other > 0.0)
    return float(np.where(free, np.abs(other - sampled), 0.0).max(initial=0.0))

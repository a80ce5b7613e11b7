"""The order in which poses are visited: short, and with moves that are proved free of collisions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from oed.experiments.assembly import limits_between_samples
from oed.retiming import PlannedMove, plan_move
from oed.trajectories import PiecewisePolynomial, Segment, Sequence
from robots.collision import CollisionModel
from robots.common.arrays import Array
from robots.common.errors import InfeasibleError
from robots.limits import Limits

LOOK = 0.04  # rad or m between looks at a move while the order is sought; the whole motion is proved afterwards
STRIDE, GROWTH = 0.4, 800  # rad or m of a branch, and branches of a detour
NEAREST = 3  # poses that are tried by a detour, before the next is left for later


@dataclass(frozen=True, kw_only=True, eq=False)
class Tour:
    """Poses in order.

    Attributes:
        order: numbers of the poses, from 0, as they are visited.
        stops: way points and poses from home to home (K, n); those at `measured` are the poses in order.
        measured: numbers of the stops at which is measured.
        left_out: poses that no move reaches.
    """

    order: tuple[int, ...]
    stops: Array
    measured: tuple[int, ...]
    left_out: tuple[int, ...] = ()


class Moves:
    """Straight moves in joint space, from rest to rest.

    Args:
        limits: that they keep, between the samples too.
        period: the controller's period [s].
    """

    def __init__(self, limits: Limits, period: float) -> None:
        self.limits, self.period = limits_between_samples(limits, period), period

    def plan(self, start: Array, end: Array) -> PlannedMove | None:
        """Plans a move; None where the poses are one."""
        return plan_move(self.limits, start, end, period=self.period, straight=True)

    def whole(self, tour: Tour, dwell: float) -> Sequence:
        """Joins the moves of a tour, with a rest at each pose that is measured.

        Args:
            tour: the stops.
            dwell: time at a pose [s].
        """
        rest = max(round(dwell / self.period), 1) * self.period
        segments = []
        for k, (start, end) in enumerate(zip(tour.stops[:-1], tour.stops[1:], strict=True), start=1):
            planned = self.plan(start, end)
            if planned is not None:
                pieces = PiecewisePolynomial(breakpoints=planned.breakpoints, coefficients=planned.coefficients)
                segments.append(Segment(kind="approach" if k == 1 else "move", trajectory=pieces))
            if k in tour.measured:
                segments.append(Segment(kind="pose", trajectory=PiecewisePolynomial.hold(end, rest)))
        return Sequence(segments=tuple(segments), period=self.period)


class Paths:
    """Straight moves between poses, each looked at once.

    Args:
        model: bodies and obstacles; None where collisions are not checked.
        clearance: to keep [m].
        bounds: lower and upper positions of detours (n,).
        seed: of detours.
    """

    def __init__(
        self, model: CollisionModel | None, clearance: float, bounds: tuple[Array, Array], seed: int = 0
    ) -> None:
        self._model, self._clearance, self._bounds = model, clearance, bounds
        self._known: dict[tuple[bytes, bytes], bool] = {}
        self._rng = np.random.default_rng(seed)

    def free(self, start: Array, end: Array) -> bool:
        """Whether the straight move keeps clear, at points along it."""
        key = (start.tobytes(), end.tobytes())
        if key not in self._known:
            self._known[key] = self._known[key[::-1]] = self._clear(_line(start, end))
        return self._known[key]

    def forbid(self, start: Array, end: Array) -> None:
        """Notes that a move was not proved free."""
        for key in ((start.tobytes(), end.tobytes()), (end.tobytes(), start.tobytes())):
            self._known[key] = False

    def detour(self, start: Array, end: Array) -> list[Array] | None:
        """Way points from one pose to another (bidirectional random trees: Kuffner and LaValle 2000), or None."""
        trees = [[start], [end]]
        parents: list[list[int]] = [[-1], [-1]]
        for step in range(GROWTH):
            own, other = step % 2, 1 - step % 2
            target = self._rng.uniform(*self._bounds)
            grown = self._grow(trees[own], parents[own], target)
            if grown is None:
                continue
            reached = self._connect(trees[other], parents[other], trees[own][grown])
            if reached is not None:
                first, second = _branch(trees[own], parents[own], grown), _branch(trees[other], parents[other], reached)
                way = [*first[::-1], *second] if own == 0 else [*second[::-1], *first]
                return self._shortcut(way)[1:-1]
        return None

    def _grow(self, tree: list[Array], parent: list[int], target: Array) -> int | None:
        near = int(np.argmin(np.linalg.norm(np.array(tree) - target, axis=1)))
        way = target - tree[near]
        length = float(np.abs(way).max())
        new = tree[near] + way * min(1.0, STRIDE / max(length, 1e-12))
        if not self.free(tree[near], new):
            return None
        tree.append(new)
        parent.append(near)
        return len(tree) - 1

    def _connect(self, tree: list[Array], parent: list[int], target: Array) -> int | None:
        place: int | None = None
        while True:
            grown = self._grow(tree, parent, target)
            if grown is None:
                return None
            if np.array_equal(tree[grown], target) or np.abs(tree[grown] - target).max() < 1e-12:
                return grown
            if place is not None and len(tree) > GROWTH:
                return None
            place = grown

    def _shortcut(self, way: list[Array]) -> list[Array]:
        """Leaves way points out whose neighbours have a free move."""
        k = 1
        while k + 1 < len(way):
            if self.free(way[k - 1], way[k + 1]):
                del way[k]
                k = max(k - 1, 1)
            else:
                k += 1
        return way

    def _clear(self, q: Array) -> bool:
        return self._model is None or not self._model.pairs or bool((self._model.clearance(q) >= self._clearance).all())


def _line(start: Array, end: Array) -> Array:
    count = max(int(np.ceil(np.abs(end - start).max() / LOOK)), 1)
    return start + np.linspace(0.0, 1.0, count + 1)[:, None] * (end - start)


def _branch(tree: list[Array], parent: list[int], leaf: int) -> list[Array]:
    """From a leaf to the root."""
    way = []
    while leaf >= 0:
        way.append(tree[leaf])
        leaf = parent[leaf]
    return way


def ordered(q: Array, home: Array, limits: Limits, paths: Paths) -> Tour:
    """Finds a short order of moves that are free: the nearest reachable pose next, then parts are turned round.

    A pose without a direct move is reached by a detour.

    Args:
        q: poses (N, n) [rad or m].
        home: pose at both ends (n,).
        limits: whose velocities say how far poses are apart.
        paths: moves and whether they are free.

    Raises:
        InfeasibleError: no pose can be reached.
    """
    speed = np.where(np.isfinite(limits.velocity), limits.velocity, 1.0)

    def time(a: Array, b: Array) -> float:
        return float(np.max(np.abs(a - b) / speed))

    left, order, here = list(range(len(q))), [], home
    lost: list[int] = []
    via: dict[tuple[int, int], list[Array]] = {}
    place = -1
    while left:
        near = sorted(left, key=lambda k: time(here, q[k]))
        following = next((k for k in near if paths.free(here, q[k])), None)
        if following is None:
            for k in near[:NEAREST]:
                detour = paths.detour(here, q[k])
                if detour is not None:
                    following, via[(place, k)] = k, detour
                    break
        if following is None:
            # This one cannot be left, or those cannot be reached: the nearest is given up.
            lost.append(near[0])
            left.remove(near[0])
            continue
        order.append(following)
        left.remove(following)
        here, place = q[following], following
    if not order:
        raise InfeasibleError(
            "no move from home to any pose is free of collisions",
            remedy="choose another home pose (--home), or state other surroundings (--floor, --no-floor)",
        )
    order = _shortened(order, q, home, paths, time, via)
    return _tour(order, q, home, paths, via, tuple(lost))


def _shortened(
    order: list[int],
    q: Array,
    home: Array,
    paths: Paths,
    time: Callable[[Array, Array], float],
    via: dict[tuple[int, int], list[Array]],
) -> list[int]:
    """Turns parts of the order round while that shortens it and all moves stay free (2-opt)."""
    if via:
        return order
    best = list(order)
    improved = True
    while improved:
        improved = False
        for i in range(len(best) - 1):
            for j in range(i + 1, len(best)):
                before = home if i == 0 else q[best[i - 1]]
                after = home if j + 1 == len(best) else q[best[j + 1]]
                old = time(before, q[best[i]]) + time(q[best[j]], after)
                new = time(before, q[best[j]]) + time(q[best[i]], after)
                if new < old - 1e-9:
                    turned = [*best[:i], *best[i : j + 1][::-1], *best[j + 1 :]]
                    stops = [home, *(q[k] for k in turned), home]
                    if all(paths.free(a, b) for a, b in zip(stops[i : j + 2], stops[i + 1 : j + 3], strict=False)):
                        best, improved = turned, True
    return best


def _tour(
    order: list[int],
    q: Array,
    home: Array,
    paths: Paths,
    via: dict[tuple[int, int], list[Array]],
    lost: tuple[int, ...],
) -> Tour:
    stops: list[Array] = [home]
    measured = []
    place = -1
    for k in order:
        stops += via.get((place, k), [])
        measured.append(len(stops))
        stops.append(q[k])
        place = k
    if not paths.free(stops[-1], home):
        detour = paths.detour(stops[-1], home)
        # Without another way, the way out leads back.
        stops += stops[1:-1][::-1] if detour is None else detour
    stops.append(home)
    return Tour(order=tuple(order), stops=np.array(stops), measured=tuple(measured), left_out=lost)

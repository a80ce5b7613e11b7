"""The order in which poses are visited: short, and with moves that are proved free of collisions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from oed.experiments.assembly import limits_between_samples
from oed.retiming import PlannedMove, plan_move
from oed.trajectories import PiecewisePolynomial, Segment, Sequence
from robots.collision import CollisionModel, check_motion
from robots.common.errors import InfeasibleError
from robots.limits import Limits
from robots.signals import Motion

Array = NDArray[np.float64]

LOOK = 0.05  # s between looks at a move; between them its way is bounded, and the whole motion is proved afterwards
NEAR = 12  # way points that are tried between two poses without a direct move


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
    """Moves between poses, each looked at once.

    Args:
        moves: plans them.
        model: bodies and obstacles; None where collisions are not checked.
        clearance: to keep [m].
    """

    def __init__(self, moves: Moves, model: CollisionModel | None, clearance: float) -> None:
        self._moves, self._model, self._clearance = moves, model, clearance
        self._known: dict[tuple[bytes, bytes], bool] = {}

    def free(self, start: Array, end: Array) -> bool:
        """Whether the direct move keeps clear, at looks along it and between them."""
        key = (start.tobytes(), end.tobytes())
        if key not in self._known:
            self._known[key] = self._look(start, end)
        return self._known[key]

    def _look(self, start: Array, end: Array) -> bool:
        planned = self._moves.plan(start, end)
        if planned is None or self._model is None:
            return True
        t = np.linspace(0.0, planned.duration, max(int(planned.duration / LOOK), 2) + 1)
        q, dq, ddq = planned.sample(t)
        motion = Motion(t=t, q=q, dq=dq, ddq=ddq)
        report = check_motion(self._model, motion, margin=self._clearance, confirm=False, max_halvings=6)
        return bool((report.clearance >= self._clearance).all()) and not report.meetings


def ordered(q: Array, home: Array, limits: Limits, paths: Paths, waypoints: Array) -> Tour:
    """Finds a short order of moves that are free: the nearest reachable pose next, then two moves at a time turned round.

    A pose without a direct move is reached by way points.

    Args:
        q: poses (N, n) [rad or m].
        home: pose at both ends (n,).
        limits: whose velocities say how far poses are apart.
        paths: moves and whether they are free.
        waypoints: free poses to pass (M, n).

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
            for k in near:
                detour = _detour(here, q[k], paths, waypoints, time)
                if detour is not None:
                    following, via[(place, k)] = k, detour
                    break
        if following is None:
            lost = left
            break
        order.append(following)
        left.remove(following)
        here, place = q[following], following
    if not order:
        raise InfeasibleError(
            "no move from home to any pose is free of collisions",
            remedy="choose another home pose (--home), or state other surroundings (--floor, --no-floor)",
        )
    order = _shortened(order, q, home, paths, time, via)
    return _tour(order, q, home, paths, waypoints, time, via, tuple(lost))


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
    waypoints: Array,
    time: Callable[[Array, Array], float],
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
        detour = _detour(stops[-1], home, paths, waypoints, time)
        if detour is None:
            # The way out leads back.
            detour = stops[1:-1][::-1]
        stops += detour
    stops.append(home)
    return Tour(order=tuple(order), stops=np.array(stops), measured=tuple(measured), left_out=lost)


def _detour(
    start: Array, end: Array, paths: Paths, waypoints: Array, time: Callable[[Array, Array], float]
) -> list[Array] | None:
    """One way point, or two, by which a pose can be reached; None where there are none."""
    ranked = sorted(waypoints, key=lambda w: time(start, w) + time(w, end))[:NEAR]
    from_start = [w for w in ranked if paths.free(start, w)]
    to_end = [w for w in ranked if paths.free(w, end)]
    for w in from_start:
        if any(w is other for other in to_end):
            return [w]
    for first in from_start:
        for second in to_end:
            if paths.free(first, second):
                return [first, second]
    return None

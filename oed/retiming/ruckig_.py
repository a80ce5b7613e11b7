"""Retiming of a polyline by ruckig: straight moves from vertex to vertex, with a stop at each.

Ruckig plans through waypoints without stopping only by a web service; this module stays on this machine and stops.
The price is time: a curve becomes a polyline within a tolerance, and each vertex costs a rest. It suits paths of few
vertices.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from oed.retiming.limits import finite_limits, limit_usage
from oed.retiming.moves import STANDSTILL, plan_move
from oed.retiming.paths import simplify
from oed.retiming.result import Retimed
from robots.common.errors import InfeasibleError, InputError
from robots.limits import Limits
from robots.signals import Motion


def retime_with_stops(path: Motion | ArrayLike, limits: Limits, *, period: float, tolerance: float = 0.01) -> Retimed:
    """Moves straight from vertex to vertex under velocity, acceleration and jerk limits, at rest at each vertex.

    Args:
        path: waypoints (W, n) [rad], all of which are vertices; or a motion, whose vertices are picked by `simplify`.
        limits: bounds; infinite accelerations and jerks as in `finite_limits`. Torque is not looked at.
        period: the controller's period [s].
        tolerance: largest distance of a motion's points from the polyline in joint space [rad].

    Returns:
        The new motion, and how much of each limit it uses.

    Raises:
        InputError: waypoints that are no finite (W, n) array with W >= 2, or a tolerance that is not positive.
        InfeasibleError: a vertex outside the position limits, a zero limit, or a path that does not move.
    """
    points = path.q if isinstance(path, Motion) else np.array(path, dtype=np.float64)
    right = points.ndim == 2 and points.shape[0] >= 2 and points.shape[1] == limits.lower.size
    if not (right and np.isfinite(points).all()):
        raise InputError(
            f"found a path of shape {points.shape}", allowed=f"two or more finite points of {limits.lower.size} joints"
        )
    if tolerance <= 0.0:
        raise InputError(f"found the tolerance {tolerance} rad or m", allowed="a positive number")
    vertices = points[simplify(points, tolerance)] if isinstance(path, Motion) else points
    moved = np.abs(np.diff(vertices, axis=0)).max(axis=1) > STANDSTILL
    vertices = vertices[np.concatenate([[True], moved])]
    parts: list[Motion] = []
    for start, end in pairwise(vertices):
        move = plan_move(limits, start, end, period=period, straight=True)
        if move is not None:
            t = period * np.arange(round(move.duration / period) + 1, dtype=np.float64)
            parts.append(Motion(t, *move.sample(t)))
    if not parts:
        raise InfeasibleError("the path contains no motion to retime")
    joined = [parts[0], *(part.slice(1, None) for part in parts[1:])]
    q, dq, ddq = (np.concatenate([getattr(part, name) for part in joined]) for name in ("q", "dq", "ddq"))
    motion = Motion(period * np.arange(q.shape[0], dtype=np.float64), q, dq, ddq)
    return Retimed(
        motion=motion,
        method="ruckig",
        duration_before=path.duration if isinstance(path, Motion) else np.nan,
        duration_after=motion.duration,
        usage=limit_usage(motion, finite_limits(limits)),
        usage_before=limit_usage(path, finite_limits(limits)) if isinstance(path, Motion) else None,
        deviation=_deviation(points, vertices),
        stops=len(parts) - 1,
        unit=limits.position_unit,
    )


def _deviation(points: np.ndarray, vertices: np.ndarray) -> float:
    """Largest distance of a point from the nearest leg of the polyline."""
    nearest = np.full(points.shape[0], np.inf)
    for start, end in pairwise(vertices):
        chord = end - start
        along = np.clip((points - start) @ chord / (chord @ chord), 0.0, 1.0)
        nearest = np.minimum(nearest, np.linalg.norm(points - start - along[:, None] * chord, axis=1))
    return float(nearest.max())

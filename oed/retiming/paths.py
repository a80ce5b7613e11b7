"""The geometric path of a motion: what is left of it when time is taken away."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import CubicSpline

from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.signals import Motion


@dataclass(frozen=True, kw_only=True, eq=False)
class PathPiece:
    """A smooth stretch of a path between two rests.

    Args:
        spline: q(s), s from 0 to `length`; s is the arc length in joint space, each joint measured by its velocity
            limit [s]. Unlike the share of the fastest joint it stays smooth where another joint becomes the fastest.
        length: total length [s].
        deviation: largest distance of a given point from the spline in any joint [rad].
    """

    spline: CubicSpline
    length: float
    deviation: float


def split_path(path: Motion | ArrayLike, velocity: Array, *, most_knots: int = 2000) -> list[PathPiece]:
    """Splits a path where it must come to rest, and lays a cubic spline through each piece.

    It must rest where the motion rests, and where it turns back by a right angle or more. Rests that last are shortened
    to an instant.

    Args:
        path: a motion, or waypoints (W, n) [rad] to pass without stopping unless they turn back.
        velocity: velocity limits that weigh the joints, (n,) [rad/s]; infinite ones weigh nothing special.
        most_knots: points closer than 1/most_knots of the length are left out of the spline; `PathPiece.deviation`
            says what that changes.

    Returns:
        The pieces in order; none for a path that does not move.

    Raises:
        InputError: waypoints that are no finite (W, n) array with W >= 2.
    """
    q = path.q if isinstance(path, Motion) else np.array(path, dtype=np.float64)
    if q.ndim != 2 or q.shape[0] < 2 or q.shape[1] != velocity.size or not np.all(np.isfinite(q)):
        raise InputError(
            f"found a path of shape {q.shape}", allowed=f"two or more finite points of {velocity.size} joints"
        )
    weight = 1.0 / np.where(np.isfinite(velocity), velocity, 1.0)
    chords = np.diff(q, axis=0) * weight
    lengths = np.linalg.norm(chords, axis=1)
    if lengths.sum() <= 1e-12:
        return []
    # Weighted speed, as a fraction of the largest, and length, as a fraction of the whole, below which nothing moves.
    kept = np.flatnonzero(np.concatenate([[True], lengths > 1e-9 * lengths.sum()]))
    kept = np.unique(np.concatenate([kept, _last_of_each_rest(kept, q.shape[0])]))
    points, stops = q[kept], np.zeros(kept.size, dtype=bool)
    if isinstance(path, Motion):
        speed = np.abs(path.dq * weight).max(axis=1)
        stops = (speed <= 1e-6 * speed.max())[kept]
    chords = np.diff(points, axis=0) * weight
    stops[1:-1] |= np.einsum("ij,ij->i", chords[:-1], chords[1:]) <= 0.0
    corners = np.unique(np.concatenate([[0], np.flatnonzero(stops), [kept.size - 1]]))
    pieces = (_piece(points[a : b + 1], weight, most_knots) for a, b in pairwise(corners))
    return [piece for piece in pieces if piece is not None]


def simplify(points: Array, tolerance: float) -> Array:
    """Picks the vertices of a polyline that passes all points within a tolerance (Douglas and Peucker 1973).

    Args:
        points: (N, n) [rad].
        tolerance: largest distance of a point from the polyline in joint space [rad].

    Returns:
        Indices of the vertices, increasing, with the first and the last point.
    """
    keep = {0, len(points) - 1}
    stack = [(0, len(points) - 1)]
    while stack:
        first, last = stack.pop()
        if last - first < 2:
            continue
        chord = points[last] - points[first]
        inner = points[first + 1 : last] - points[first]
        along = np.clip(inner @ chord / max(chord @ chord, 1e-300), 0.0, 1.0)
        distance = np.linalg.norm(inner - along[:, None] * chord, axis=1)
        worst = int(distance.argmax())
        if distance[worst] > tolerance:
            middle = first + 1 + worst
            keep.add(middle)
            stack += [(first, middle), (middle, last)]
    return np.array(sorted(keep))


def _last_of_each_rest(kept: NDArray[np.int64], count: int) -> NDArray[np.int64]:
    """The very last sample, which rounding may have made part of a rest, has to stay."""
    return np.array([count - 1]) if kept[-1] != count - 1 else kept[-1:]


def _piece(points: Array, weight: Array, most_knots: int) -> PathPiece | None:
    s = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0) * weight, axis=1))])
    if s[-1] <= 1e-9:
        return None
    spacing = s[-1] / most_knots
    knots = [0]
    for index in range(1, s.size - 1):
        if s[index] - s[knots[-1]] >= spacing and s[-1] - s[index] >= spacing:
            knots.append(index)
    knots.append(s.size - 1)
    spline = CubicSpline(s[knots], points[knots])
    deviation = float(np.abs(spline(s) - points).max())
    return PathPiece(spline=spline, length=float(s[-1]), deviation=deviation)

"""Exact distances of segments to segments, boxes and planes, on whole arrays at a time."""

from __future__ import annotations

import numpy as np

from robots.common.arrays import Array


def segment_segment(a0: Array, a1: Array, b0: Array, b1: Array) -> Array:
    """Distance of two segments, ``min |a0 + s (a1 - a0) - b0 - t (b1 - b0)|`` over s and t in [0, 1].

    Args:
        a0: (..., 3) one end of the first [m].
        a1: (..., 3) its other end.
        b0: (..., 3) one end of the second.
        b1: (..., 3) its other end.

    Returns:
        (...) [m].

    Source: Ericson, Real-Time Collision Detection (2005), section 5.1.9.
    """
    u, v, w = a1 - a0, b1 - b0, a0 - b0
    a, e, b = _dot(u, u), _dot(v, v), _dot(u, v)
    c, f = _dot(u, w), _dot(v, w)
    determinant = a * e - b * b
    # For lines that are more nearly parallel, rounding decides where they are closest.
    apart = determinant > 1e-6 * a * e
    s = _clip(np.where(apart, (b * f - c * e) / np.where(apart, determinant, 1.0), 0.0))
    t = _clip(_ratio(b * s + f, e))
    s = _clip(_ratio(b * t - c, a))
    distance = np.asarray(np.linalg.norm(w + s[..., None] * u - t[..., None] * v, axis=-1))
    if not apart.all():
        # Then one of the four ends is closest, or as good as it.
        near = ~apart
        ends = [
            _point_segment(p[near], q[near], r[near])
            for p, q, r in ((a0, b0, v), (a1, b0, v), (b0, a0, u), (b1, a0, u))
        ]
        distance[near] = np.minimum(distance[near], np.min(ends, axis=0))
    return distance


def _point_segment(point: Array, start: Array, direction: Array) -> Array:
    along = _clip(_ratio(_dot(point - start, direction), _dot(direction, direction)))
    return np.linalg.norm(point - start - along[..., None] * direction, axis=-1)


def segment_box(x0: Array, x1: Array, half: Array) -> Array:
    """Distance of a segment to the box ``|x_i| <= half_i``; zero where they meet.

    The slope of the squared distance along the segment is piecewise linear and never falls, with kinks where the
    segment passes the planes of the faces: the root lies between two neighbouring kinks, where interpolation is exact.

    Args:
        x0: (..., 3) one end in the frame of the box [m].
        x1: (..., 3) its other end.
        half: (3,) or (..., 3) half the edges [m].

    Returns:
        (...) [m].
    """
    d = x1 - x0
    with np.errstate(divide="ignore", invalid="ignore"):
        kinks = np.concatenate([(half - x0) / d, (-half - x0) / d], axis=-1)
    kinks = np.where(np.isfinite(kinks), np.clip(kinks, 0.0, 1.0), 0.0)
    s = np.concatenate([kinks, np.zeros((*d.shape[:-1], 1)), np.ones((*d.shape[:-1], 1))], axis=-1)  # (..., 8)
    x = x0[..., None, :] + s[..., None] * d[..., None, :]
    bound = np.broadcast_to(np.asarray(half), x0.shape)[..., None, :]
    slope = _dot(x - np.clip(x, -bound, bound), d[..., None, :])
    low = np.where(slope <= 0.0, s, 0.0).max(axis=-1)
    high = np.where(slope >= 0.0, s, 1.0).min(axis=-1)
    slope_low = np.where(slope <= 0.0, slope, -np.inf).max(axis=-1)
    slope_high = np.where(slope >= 0.0, slope, np.inf).min(axis=-1)
    between = (low < high) & np.isfinite(slope_low) & np.isfinite(slope_high)
    share = np.where(between, -slope_low, 0.0) / np.where(between, slope_high - slope_low, 1.0)
    best = np.where(between, low + (high - low) * share, low)
    x = x0 + best[..., None] * d
    return np.linalg.norm(x - np.clip(x, -bound[..., 0, :], bound[..., 0, :]), axis=-1)


def segment_plane(x0: Array, x1: Array, normal: Array, offset: float) -> Array:
    """Signed height of a segment above a plane, ``min(normal . x0, normal . x1) - offset``.

    Args:
        x0: (..., 3) one end [m].
        x1: (..., 3) its other end.
        normal: (3,) of unit length.
        offset: [m].

    Returns:
        (...) [m].
    """
    return np.minimum(x0 @ normal, x1 @ normal) - offset


def _dot(x: Array, y: Array) -> Array:
    return np.sum(x * y, axis=-1)


def _clip(x: Array) -> Array:
    return np.clip(x, 0.0, 1.0)


def _ratio(numerator: Array, denominator: Array) -> Array:
    """Divides; zero for a segment without length, every point of which is the same."""
    solid = denominator > 0.0
    return np.where(solid, numerator / np.where(solid, denominator, 1.0), 0.0)

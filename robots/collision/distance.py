r"""Smooth clearances with exact gradients, never larger than the true ones.

The distance of two segments has kinks where they pass through being parallel, for the closest points jump from one end
to the other. A strictly convex share added to the squared distance,

    f = min over s, t in [0, 1] of  |a(s) - b(t)|^2 + e^2 ((s - 1/2)^2 + (t - 1/2)^2),      e^2 = 2 k,

makes the minimiser unique and continuous, so that f has a continuous gradient: by Danskin's theorem that of the
bracket at the minimiser, held fixed. The share lies between 0 and k, hence d^2 - k <= f - k <= d^2. With the sum rho of
the radii and k = 2 rho c - c^2 the clearance

    h = phi(f - k) - rho,   phi(x) = sqrt(x) for x >= rho^2 / 4, its tangent below,

keeps, for a stated smoothing c < rho and the true distance d of the segments,

    h <= d - rho               where d >= rho / 2 (below, h <= -rho / 2: a collision stays one),
    h >= d - rho - c           where d >= rho (no collision), and
    h >= d - rho - 2 c         everywhere.

A segment and a box are treated alike with one parameter. Of a plane, the smooth minimum of the two ends' heights is
used, which is at most c too small. Where the two spines cross, or a spine is within a box, d is zero and no direction
leads out: the gradient vanishes there, deep inside of a collision.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import casadi
import numpy as np

from robots.common.arrays import Array

Segment = tuple[casadi.SX, casadi.SX]  # its two ends, (3, 1) each, in the base frame [m]


@dataclass(frozen=True, eq=False)
class Contact:
    """A clearance and what moves it.

    Attributes:
        clearance: h [m].
        direction: (3,) by which h grows when the point moves.
        point: (3,) on the second body's spine, in the base frame [m].
    """

    clearance: casadi.SX
    direction: casadi.SX
    point: casadi.SX


def segment_segment(a: Segment, b: Segment, spheres: tuple[bool, bool], rho: float, smoothing: float) -> Contact:
    """Clearance of two capsules.

    Args:
        a: spine of the first.
        b: spine of the second; the contact's point is on it.
        spheres: whether each is a point, its two ends being one.
        rho: sum of the radii [m].
        smoothing: c, less than rho [m].
    """
    gap = _gap(rho, smoothing)
    u, v, w = a[1] - a[0], b[1] - b[0], a[0] - b[0]
    free = 2 - sum(spheres)
    share = 4.0 * gap / free if free else 0.0  # e^2: each free parameter's term reaches e^2 / 4
    s, t = casadi.SX(0.5), casadi.SX(0.5)
    # Zeros of the gradient: e_s s - b t = c_s and e_t t - b s = c_t.
    e_s, e_t, mixed = casadi.dot(u, u) + share, casadi.dot(v, v) + share, casadi.dot(u, v)
    c_s, c_t = share / 2.0 - casadi.dot(u, w), share / 2.0 + casadi.dot(v, w)
    if spheres[0] and not spheres[1]:
        t = _clip(c_t / e_t)
    elif spheres[1] and not spheres[0]:
        s = _clip(c_s / e_s)
    elif free == 2:
        # Clamping one parameter after the other is exact for a strictly convex quadratic function on a square.
        s = _clip((c_s * e_t + mixed * c_t) / (e_s * e_t - mixed * mixed))
        t = _clip((c_t + mixed * s) / e_t)
        s = _clip((c_s + mixed * t) / e_s)
    point = b[0] + t * v if not spheres[1] else b[0]
    apart = point - (a[0] + s * u if not spheres[0] else a[0])
    f = casadi.dot(apart, apart) + share * ((s - 0.5) ** 2 + (t - 0.5) ** 2)
    return _contact(f - gap if free else f, apart, point, rho)


def segment_box(x: Segment, sphere: bool, pose: Array, half: Array, rho: float, smoothing: float) -> Contact:
    """Clearance of a capsule from a box.

    The slope along the spine is piecewise linear and strictly increasing, with kinks where the spine passes the planes
    of the faces; between the two kinks around its root interpolation is exact.

    Args:
        x: spine of the capsule.
        sphere: whether it is a point.
        pose: (4, 4) of the box.
        half: (3,) half its edges [m].
        rho: radius of the capsule [m].
        smoothing: c, less than rho [m].
    """
    turn = casadi.sparsify(casadi.SX(np.where(np.abs(pose[:3, :3]) < 1e-15, 0.0, pose[:3, :3])))
    x0, x1 = (turn.T @ (end - casadi.SX(pose[:3, 3])) for end in x)
    gap = 0.0 if sphere else _gap(rho, smoothing)
    d, share, s = x1 - x0, 4.0 * gap, casadi.SX(0.5)
    if not sphere:
        s = _root(lambda k: casadi.dot(_outside(x0 + k * d, half), d) + share * (k - 0.5), x0, d, half)
    apart = _outside(x0 + s * d, half)
    f = casadi.dot(apart, apart) + (share * (s - 0.5) ** 2 - gap if not sphere else 0.0)
    return _contact(f, turn @ apart, x[0] + s * (x[1] - x[0]), rho)


def segment_plane(x: Segment, sphere: bool, normal: Array, offset: float, rho: float, smoothing: float) -> Contact:
    """Clearance of a capsule from a plane: ``(a + b) / 2 - sqrt((a - b)^2 / 4 + c^2)`` of its ends' heights a and b.

    Args:
        x: spine of the capsule.
        sphere: whether it is a point.
        normal: (3,) unit vector to the free side.
        offset: of the plane along it [m].
        rho: radius of the capsule [m].
        smoothing: c [m].
    """
    direction = casadi.sparsify(casadi.SX(normal))
    first = casadi.dot(direction, x[0]) - offset
    if sphere:
        return Contact(first - rho, direction, x[0])
    second = casadi.dot(direction, x[1]) - offset
    half = (first - second) / 2.0
    root = casadi.sqrt(half**2 + smoothing**2)
    weight = 0.5 - half / (2.0 * root)
    return Contact((first + second) / 2.0 - root - rho, direction, weight * x[0] + (1.0 - weight) * x[1])


def _contact(x: casadi.SX, apart: casadi.SX, point: casadi.SX, rho: float) -> Contact:
    """Turns f - k into a clearance; `apart` leads from the first body's closest point to the second's."""
    bounded = casadi.fmax(x, rho**2 / 4.0)
    root = casadi.sqrt(bounded)
    return Contact(root + (x - bounded) / (2.0 * root) - rho, apart / root, point)


def _root(slope: Callable[[casadi.SX], casadi.SX], x0: casadi.SX, d: casadi.SX, half: Array) -> casadi.SX:
    """Finds where an increasing slope, linear between the kinks, is zero in [0, 1], or the end that is nearer to it.

    Every kink halves what is left of the interval; choosing is written as arithmetic, for compilers do that on whole
    vectors.
    """
    low, high = casadi.SX(0.0), casadi.SX(1.0)
    slope_low, slope_high = slope(low), slope(high)
    for i in range(3):
        for bound in (-half[i], half[i]):
            kink = casadi.fmin(casadi.fmax((bound - x0[i]) / d[i], low), high)
            value = slope(kink)
            below = value <= 0.0
            above = 1.0 - below
            low, slope_low = low + below * (kink - low), slope_low + below * (value - slope_low)
            high, slope_high = high + above * (kink - high), slope_high + above * (value - slope_high)
    # The added number is for a root at a kink, where the interval has shrunk to nothing.
    return _clip(low - (high - low) * slope_low / (slope_high - slope_low + 1e-30))


def _gap(rho: float, smoothing: float) -> float:
    return 2.0 * rho * smoothing - smoothing**2


def _clip(x: casadi.SX) -> casadi.SX:
    # This order turns the 0 / 0 of an edge that runs within a face into a number.
    return casadi.fmin(casadi.fmax(x, 0.0), 1.0)


def _outside(x: casadi.SX, half: Array) -> casadi.SX:
    # x less its nearest point of the box, x - min(max(x, -h), h), as compilers like it best.
    bound = casadi.SX(half)
    return x + (casadi.fabs(x - bound) - casadi.fabs(x + bound)) / 2.0

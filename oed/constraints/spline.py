"""What a spline does between its samples: its control points, and those of its derivatives, enclose it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from oed.constraints.between_samples import Extremes
from oed.constraints.kinematic import QUANTITIES, KinematicRows
from robots.common.errors import InfeasibleError, InputError
from robots.limits import Limits

Array = NDArray[np.float64]


def hull_matrices(knots: ArrayLike, expansion: ArrayLike, degree: int, refinement: int = 1) -> tuple[Array, ...]:
    """Maps free control points to the control points of position, velocity, acceleration and jerk.

    A spline lies within the convex hull of its control points, for the B-splines are not negative and add up to one.
    Its derivative is a spline of one degree less on the same knots, with the control points
    degree (c_{i+1} - c_i) / (u_{i+degree+1} - u_{i+1}) (de Boor, A Practical Guide to Splines, ch. X). Inserting knots
    changes neither, but brings the control points closer (Boehm 1980): with intervals of length h after insertion, a
    bound of a spline g of degree d from its control points is passed over by at most

        (d + 1) / 24 h^2 max |control points of g''|

    Args:
        knots: u, (m + degree + 1,) [s], clamped, inner knots simple.
        expansion: (m, K), from free control points to those of the spline.
        degree: of the position, at least 3.
        refinement: pieces into which knots are inserted to divide every interval.

    Returns:
        Four matrices (R_d, K): control points of q, dq, ddq, dddq after insertion.

    Raises:
        InputError: numbers that do not fit one another.
    """
    u, points = np.asarray(knots, dtype=np.float64), np.asarray(expansion, dtype=np.float64)
    if degree < 3 or points.ndim != 2 or u.shape != (points.shape[0] + degree + 1,) or np.any(np.diff(u) < 0.0):
        raise InputError(
            f"found {u.size} knots for control points of shape {points.shape} at degree {degree}",
            allowed="degree + 1 knots more than control points, increasing, of degree 3 or more",
        )
    if refinement != int(refinement) or refinement < 1:
        raise InputError(f"found a refinement of {refinement}", allowed="a whole number, at least 1")
    matrices = []
    for order in range(4):
        if order:
            higher = degree + 1 - order
            points = higher * np.diff(points, axis=0) / (u[higher + 1 : -1] - u[1 : -higher - 1])[:, None]
            u = u[1:-1]
        matrices.append(_refined(u, points, degree - order, refinement)[1])
    return tuple(matrices)


def spline_rows(
    knots: ArrayLike,
    expansion: ArrayLike,
    degree: int,
    limits: Limits,
    *,
    refinement: int = 1,
    quantities: Sequence[str] = QUANTITIES,
) -> KinematicRows:
    """Writes the kinematic limits as rows on control points that, kept there, hold at all times.

    Args:
        knots: (m + degree + 1,) [s].
        expansion: (m, K), from free control points to those of the spline.
        degree: of the position, 3 or more.
        limits: bounds of all joints; infinite ones give no row where no joint has one.
        refinement: pieces into which every interval is divided; more rows are less cautious (`hull_matrices`).
        quantities: which of `q`, `dq`, `ddq`, `dddq` to limit.

    Returns:
        The rows, quantity by quantity, labelled with the index of the control point; rows that are zero or repeat their
        forerunner are left out.

    Raises:
        InfeasibleError: a joint with a limit of zero.
        InputError: an unknown quantity, a limit on one side only, or numbers that do not fit one another.
    """
    hulls = dict(zip(QUANTITIES, hull_matrices(knots, expansion, degree, refinement), strict=True))
    bounds = {
        "q": (limits.lower, limits.upper),
        "dq": (-limits.velocity, limits.velocity),
        "ddq": (-limits.acceleration, limits.acceleration),
        "dddq": (-limits.jerk, limits.jerk),
    }
    columns, joints = np.shape(expansion)[1], limits.n
    blocks: list[Array] = [np.zeros((0, columns))]
    lower: list[Array] = [np.zeros((joints, 0))]
    upper: list[Array] = [np.zeros((joints, 0))]
    labels: list[tuple[str, int]] = []
    for quantity in quantities:
        if quantity not in bounds:
            raise InputError(f"found the quantity {quantity!r}", allowed=", ".join(QUANTITIES))
        low, high = bounds[quantity]
        _check_bounds(quantity, low, high)
        if not np.any(np.isfinite(high)):
            continue
        rows = hulls[quantity]
        scale = np.abs(rows).max()
        news = np.abs(np.diff(rows, axis=0, prepend=np.full((1, columns), np.inf))).max(axis=1) > 1e-13 * scale
        kept = np.flatnonzero(news & (np.abs(rows).max(axis=1) > 1e-13 * scale))
        blocks.append(rows[kept])
        lower.append(np.repeat(low[:, None], kept.size, axis=1))
        upper.append(np.repeat(high[:, None], kept.size, axis=1))
        labels += [(quantity, int(index)) for index in kept]
    return KinematicRows(matrix=np.vstack(blocks), lower=np.hstack(lower), upper=np.hstack(upper), labels=tuple(labels))


def spline_extremes(knots: ArrayLike, controls: ArrayLike, degree: int, *, refinement: int = 16) -> dict[str, Extremes]:
    """Encloses the range of position, velocity, acceleration and jerk of splines, for all times.

    Args:
        knots: (m + degree + 1,) [s].
        controls: control points of the position, (n, m) [rad]: ``points @ expansion.T`` of a `BSpline`.
        degree: of the position, 3 or more.
        refinement: pieces into which every interval is divided; the enclosure is wider than the range by at most what
            `hull_matrices` states, which falls with its square.

    Returns:
        Bounds of `q`, `dq`, `ddq` and `dddq`, in rad and s, that are never passed; where is that of the control point
        that sets it (the mean of its inner knots), as a fraction of the duration.

    Raises:
        InputError: numbers that do not fit one another.
    """
    u, points = np.asarray(knots, dtype=np.float64), np.asarray(controls, dtype=np.float64)
    if points.ndim != 2:
        raise InputError(f"found control points of {points.ndim} dimensions", allowed="2")
    hulls = hull_matrices(u, np.eye(points.shape[1]), degree, refinement)
    extremes = {}
    for order, (quantity, hull) in enumerate(zip(QUANTITIES, hulls, strict=True)):
        values = points @ hull.T  # (n, R)
        inner = u[order : u.size - order]
        refined = _refined(inner, np.zeros((inner.size - degree + order - 1, 0)), degree - order, refinement)[0]
        at = _places(refined, degree - order) / u[-1]
        extremes[quantity] = Extremes(
            lowest=values.min(axis=1),
            highest=values.max(axis=1),
            lowest_at=at[values.argmin(axis=1)],
            highest_at=at[values.argmax(axis=1)],
        )
    return extremes


def _refined(knots: Array, points: Array, degree: int, pieces: int) -> tuple[Array, Array]:
    """Inserts knots one by one (Boehm's algorithm): each new control point is a mean of two old ones."""
    inner = np.unique(knots)
    steps = np.diff(inner)[:, None] * np.arange(1, pieces) / pieces
    for knot in (inner[:-1, None] + steps).ravel():
        span = int(np.searchsorted(knots, knot, side="right")) - 1
        index = np.arange(span - degree + 1, span + 1)
        share = ((knot - knots[index]) / (knots[index + degree] - knots[index]))[:, None]
        between = share * points[index] + (1.0 - share) * points[index - 1]
        points = np.vstack([points[: span - degree + 1], between, points[span:]])
        knots = np.insert(knots, span + 1, knot)
    return knots, points


def _places(knots: Array, degree: int) -> Array:
    """Where control points belong: the means of their inner knots, or the middle of the piece of a step function."""
    if degree == 0:
        return (knots[:-1] + knots[1:]) / 2.0
    return np.lib.stride_tricks.sliding_window_view(knots[1:-1], degree).mean(axis=1)


def _check_bounds(quantity: str, low: Array, high: Array) -> None:
    if np.any(high - low <= 0.0):
        joint = int(np.argmax(high - low <= 0.0)) + 1
        raise InfeasibleError(f"the limit of {quantity} leaves no room to move", joint=joint)
    lonely = np.isfinite(low) != np.isfinite(high)
    if np.any(lonely):
        raise InputError(
            f"has a {quantity} limit on one side only",
            joint=int(np.argmax(lonely)) + 1,
            allowed="a limit on both sides, or none",
        )

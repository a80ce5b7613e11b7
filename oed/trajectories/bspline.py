"""Clamped uniform B-splines that rest at both ends: local control, and derivatives bounded by their control points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.interpolate
from numpy.typing import ArrayLike

from oed.trajectories.base import Array, Kinematics, Trajectory, frozen
from robots.common.errors import InputError

DEGREES = (3, 5)
"""Cubic: the jerk is piecewise constant. Quintic: the jerk is continuous, its rate too."""

REPEATED = 3
"""Equal control points at either end: they make velocity and acceleration vanish there, at either degree."""


@dataclass(frozen=True, kw_only=True, eq=False)
class BSpline(Trajectory):
    """Joint positions as clamped uniform B-splines, at rest at both ends.

    q_i(t) = sum_k c_ki B_k(t), where the first and the last of the K free control points count three times each
    (`expansion`), so that dq = ddq = 0 there and q starts at c_1 and ends at c_K (de Boor, A Practical Guide to
    Splines, ch. IX and X). A control point moves the spline over degree + 1 knot intervals only.

    Args:
        points: the free control points c, (n, K) [rad], K >= 2.
        duration: of the motion [s].
        degree: 3 or 5.

    Raises:
        InputError: fewer than two control points, another degree, or a duration that is not positive.
    """

    points: Array
    # Without a default the base class' property of this name would become one; zero is refused.
    duration: float = 0.0
    degree: int = 5

    def __post_init__(self) -> None:
        object.__setattr__(self, "points", frozen(self.points, "points", 2))
        _check(self.points.shape[1], self.degree, self.duration)

    @property
    def n(self) -> int:
        """Number of joints."""
        return self.points.shape[0]

    @property
    def knots(self) -> Array:
        """All knots, those at the ends degree + 1 times, (K + 4 + degree + 1,) [s]."""
        return _knots(self.points.shape[1], self.degree, self.duration)

    @property
    def expansion(self) -> Array:
        """The 0-1 matrix (K + 4, K) from free control points to those of the spline."""
        return _expansion(self.points.shape[1])

    def basis(self, t: ArrayLike) -> Kinematics:
        """The matrices that map the free control points to the kinematics, common to all joints (`bspline_basis`).

        Args:
            t: times, (M,) [s].

        Returns:
            Four matrices (M, K): q = Bq @ points.T, and so on.
        """
        return bspline_basis(t, self.points.shape[1], self.duration, self.degree)

    def sample(self, t: ArrayLike) -> Kinematics:
        """Evaluates the spline; a time outside the duration takes the value at the nearer end.

        Args:
            t: times, (N,) [s].

        Returns:
            Position, velocity, acceleration and jerk, each (N, n); at a knot those of the later piece.
        """
        columns = self.points.T
        return Kinematics(*(matrix @ columns for matrix in self.basis(t)))


def bspline_basis(t: ArrayLike, count: int, duration: float, degree: int = 5) -> Kinematics:
    """Evaluates the B-splines of the free control points and their derivatives by de Boor's recursion.

    Args:
        t: times, (M,) [s]; one outside 0..duration takes the value at the nearer end.
        count: number K of free control points, at least 2.
        duration: of the motion [s].
        degree: 3 or 5.

    Returns:
        Four matrices (M, K): position, velocity, acceleration, jerk; exactly zero outside each function's support.

    Raises:
        InputError: fewer than two control points, another degree, or a duration that is not positive.
    """
    _check(count, degree, duration)
    times = np.clip(np.asarray(t, dtype=np.float64), 0.0, duration)
    spline = scipy.interpolate.BSpline(_knots(count, degree, duration), _expansion(count), degree)
    matrices = [np.ascontiguousarray(spline(times, nu=order)) for order in range(4)]
    # The repeated control points cancel at the ends, but for rounding.
    still = (times == 0.0) | (times == duration)
    for matrix in matrices[1:3]:
        matrix[still] = 0.0
    return Kinematics(*matrices)


def _knots(count: int, degree: int, duration: float) -> Array:
    intervals = count + 2 * (REPEATED - 1) - degree
    inner = np.linspace(0.0, duration, intervals + 1)
    return np.concatenate([np.zeros(degree), inner, np.full(degree, duration)])


def _expansion(count: int) -> Array:
    owner = np.clip(np.arange(count + 2 * (REPEATED - 1)) - (REPEATED - 1), 0, count - 1)
    return np.eye(count)[owner]


def _check(count: int, degree: int, duration: float) -> None:
    if degree not in DEGREES:
        raise InputError(f"found a spline of degree {degree}", allowed=" or ".join(map(str, DEGREES)))
    if count < 2:
        raise InputError(f"found {count} free control points", allowed="at least 2: where it starts and where it ends")
    if not (np.isfinite(duration) and duration > 0):
        raise InputError(f"found a duration of {duration} s", allowed="a positive number")

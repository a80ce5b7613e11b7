"""Quintic B-splines: a coefficient moves the joint over six intervals only."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np
import scipy.interpolate
from numpy.typing import ArrayLike

from oed.trajectories.base import Array, Kinematics
from oed.trajectories.families.base import Family
from robots.common.errors import InputError

SPLINE_DEGREE = 5
REPEATED_POINTS = 3
"""Equal control points at either end: they make velocity and acceleration vanish there."""


@dataclass(frozen=True, kw_only=True)
class BSpline(Family):
    """Clamped uniform quintic B-splines that start and end in one pose, at rest.

    q_i(t) = q0_i + sum_k d_ki B_k(t). The first and the last three control points are q0, so that dq = ddq = 0 at both
    ends (de Boor, A Practical Guide to Splines, ch. IX and X). The jerk is continuous; it need not vanish at the ends.

    Attributes:
        points: inner control points of each joint, at least 1; with q0, K = points + 1.
        length: of one repetition [s].

    Raises:
        InputError: numbers out of range.
    """

    name: ClassVar[str] = "bspline"

    points: int = 8
    length: float = 10.0

    def __post_init__(self) -> None:
        if self.points < 1 or self.points != int(self.points):
            raise InputError(f"found {self.points} inner control points", allowed="a whole number, at least 1")
        if not (np.isfinite(self.length) and self.length > 0):
            raise InputError(f"found a length of {self.length} s", allowed="a positive number")

    @classmethod
    def of_size(cls, harmonics: int, base_frequency: float) -> Self:
        """Builds the spline with 2 N - 1 coefficients a joint."""
        return cls(points=2 * harmonics - 2, length=1 / base_frequency)

    @property
    def size(self) -> int:
        """One for the pose at both ends, and one for each inner control point."""
        return self.points + 1

    @property
    def duration(self) -> float:
        """Of one repetition [s]."""
        return self.length

    @property
    def knots(self) -> Array:
        """All knots, those at the ends six times (points + 12,) [s]."""
        inner = np.linspace(0.0, self.length, self.points + 2 * REPEATED_POINTS - SPLINE_DEGREE + 1)
        return np.concatenate([np.zeros(SPLINE_DEGREE), inner, np.full(SPLINE_DEGREE, self.length)])

    def basis(self, t: ArrayLike) -> Kinematics:
        """Evaluates one and the inner B-splines by de Boor's recursion."""
        times = np.clip(np.asarray(t, dtype=np.float64), 0.0, self.length)
        inner = np.eye(self.points + 2 * REPEATED_POINTS)[:, REPEATED_POINTS:-REPEATED_POINTS]
        spline = scipy.interpolate.BSpline(self.knots, inner, SPLINE_DEGREE)
        constant = np.zeros((len(times), 1))
        matrices = [np.hstack([constant, spline(times, nu=order)]) for order in range(4)]
        matrices[0][:, 0] = 1.0
        # The inner functions rest at the ends, but for rounding.
        still = (times == 0.0) | (times == self.length)
        for matrix in matrices[:3]:
            matrix[still, 1:] = 0.0
        return Kinematics(*matrices)

    def scale(self, half: Array, velocity: Array) -> Array:
        """Half the range for each coefficient: control points enclose the spline."""
        return np.repeat(half[:, None], self.size, axis=1)

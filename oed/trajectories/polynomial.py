"""Piecewise polynomials: planned moves, holds, and any motion with a profile of jerks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from oed.trajectories.base import Array, Kinematics, Trajectory, frozen
from robots.common.errors import InputError


@dataclass(frozen=True, kw_only=True, eq=False)
class PiecewisePolynomial(Trajectory):
    """A trajectory of polynomial pieces, in powers of the time since the start of each piece.

    On piece k, with s = t - breakpoints[k]: q_i(t) = sum_d coefficients[k, i, d] s^d.

    Args:
        breakpoints: (K+1,) [s], increasing, from 0.
        coefficients: (K, n, D+1) [rad/s^d].

    Raises:
        InputError: shapes that do not fit, or breakpoints that do not increase from 0.
    """

    breakpoints: Array
    coefficients: Array

    def __post_init__(self) -> None:
        object.__setattr__(self, "breakpoints", frozen(self.breakpoints, "breakpoints", 1))
        object.__setattr__(self, "coefficients", frozen(self.coefficients, "coefficients", 3))
        if self.breakpoints.size != self.coefficients.shape[0] + 1 or self.breakpoints.size < 2:
            raise InputError(
                f"found {self.breakpoints.size} breakpoints for {self.coefficients.shape[0]} pieces",
                allowed="one more than pieces, and at least one piece",
            )
        if self.breakpoints[0] != 0.0 or np.any(np.diff(self.breakpoints) <= 0.0):
            raise InputError("the breakpoints of a piecewise polynomial do not increase from 0")

    @classmethod
    def hold(cls, q: ArrayLike, duration: float) -> PiecewisePolynomial:
        """A rest at one pose.

        Args:
            q: the pose, (n,) [rad].
            duration: how long [s].

        Returns:
            The trajectory that stays there.
        """
        pose = frozen(q, "q", 1)
        return cls(breakpoints=np.array([0.0, duration]), coefficients=pose[None, :, None])

    @property
    def n(self) -> int:
        """Number of joints."""
        return self.coefficients.shape[1]

    @property
    def duration(self) -> float:
        """Duration in s."""
        return float(self.breakpoints[-1])

    def sample(self, t: ArrayLike) -> Kinematics:
        """Evaluates the pieces; a time outside the duration takes the value at the nearer end.

        Args:
            t: times, (N,) [s].

        Returns:
            Position, velocity, acceleration and jerk, each (N, n); at a breakpoint that of the later piece.
        """
        times = np.clip(np.asarray(t, dtype=np.float64), 0.0, self.duration)
        piece = np.clip(np.searchsorted(self.breakpoints, times, side="right") - 1, 0, self.coefficients.shape[0] - 1)
        local = (times - self.breakpoints[piece])[:, None]
        factors = self.coefficients[piece]  # (N, n, D+1)
        values = []
        for _ in range(4):
            value = np.zeros(factors.shape[:2])
            for power in range(factors.shape[2] - 1, -1, -1):
                value = value * local + factors[:, :, power]
            values.append(value)
            factors = factors[:, :, 1:] * np.arange(1, factors.shape[2])
        return Kinematics(*values)

"""The law s(t) by which a path is run through: from a grid of path speeds to samples at the controller's period."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline, PPoly

from robots.common.arrays import Array


@dataclass(frozen=True, kw_only=True, eq=False)
class TimeLaw:
    """s(t) with constant acceleration on each cell of a grid, averaged over a sliding window, and stretched.

    With S the integral of the unaveraged law: s(t) = (S(t') - S(t' - window)) / window, t' = t / stretch. The average
    keeps the speed and acceleration of the law within their ranges, makes the acceleration continuous and the jerk
    finite, begins and ends without acceleration, and lasts one window longer.

    Args:
        law: the unaveraged s(t), quadratic pieces.
        window: averaging window [s], positive.
        stretch: factor on all times.
    """

    law: PPoly
    window: float
    stretch: float = 1.0

    @classmethod
    def from_grid(cls, s: Array, speed: Array, window: float) -> TimeLaw:
        """Builds the law from path speeds on a grid (constant acceleration between: TOPP-RA's own assumption).

        Args:
            s: path positions, (G+1,), increasing.
            speed: ds/dt there, (G+1,) [1/s], zero at most at isolated points.
            window: averaging window [s].

        Returns:
            The law.
        """
        steps = 2.0 * np.diff(s) / (speed[:-1] + speed[1:])
        acceleration = np.diff(speed) / steps
        law = PPoly(np.stack([acceleration / 2.0, speed[:-1], s[:-1]]), np.concatenate([[0.0], np.cumsum(steps)]))
        return cls(law=law, window=window)

    @property
    def duration(self) -> float:
        """Duration in s."""
        return float(self.stretch * (self.law.x[-1] + self.window))

    def sample(self, t: Array) -> tuple[Array, Array, Array]:
        """Evaluates s, ds/dt and d2s/dt2 at times within the duration, (N,) each."""
        local = t / self.stretch
        now, before = np.clip(local, 0.0, None), np.clip(local - self.window, 0.0, None)
        integral = self.law.antiderivative()
        values = []
        for order, curve in enumerate((integral, self.law, self.law.derivative())):
            difference = self._beyond(curve, order, now) - self._beyond(curve, order, before)
            values.append(difference / self.window / self.stretch**order)
        return values[0], values[1], values[2]

    def _beyond(self, curve: PPoly, order: int, t: Array) -> Array:
        """The integral of s (order 0), s or ds/dt (2) after the end, where s rests at its last value."""
        end = self.law.x[-1]
        inside = curve(np.minimum(t, end))
        if order == 0:
            return np.asarray(inside + self.law(end) * np.maximum(t - end, 0.0))
        return np.asarray(inside if order == 1 else np.where(t >= end, 0.0, inside))


def kinematics(spline: CubicSpline, s: Array, ds: Array, dds: Array) -> tuple[Array, Array, Array]:
    """Moves along a path: q = p(s), dq = p' ds, ddq = p'' ds^2 + p' dds.

    Args:
        spline: the path p(s).
        s: path positions, (N,).
        ds: their rate [1/s], (N,).
        dds: their second rate [1/s^2], (N,).

    Returns:
        Position, velocity and acceleration, (N, n) each.
    """
    slope, bend = spline(s, 1), spline(s, 2)
    return spline(s), slope * ds[:, None], bend * ds[:, None] ** 2 + slope * dds[:, None]

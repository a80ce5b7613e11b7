"""The squared speed x(s) along a path as a quadratic spline, and the timing t(s) that it means."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robots.common.arrays import Array

Indices = NDArray[np.int64]

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(10)


@dataclass(frozen=True, kw_only=True, eq=False)
class SpeedGrid:
    """Equal intervals along a path, and the quadratic B-splines on them: at each point three are not zero.

    Args:
        length: of the path parameter [s].
        intervals: K; there are K + 2 splines.
    """

    length: float
    intervals: int

    @property
    def size(self) -> int:
        """Number of splines."""
        return self.intervals + 2

    @property
    def step(self) -> float:
        """Length of an interval [s]."""
        return self.length / self.intervals

    def basis(self, s: Array) -> tuple[Indices, Array, Array, Array]:
        """Evaluates the splines.

        Args:
            s: path positions, (M,), within the length.

        Returns:
            The first of the three splines (M,), their values, and first and second derivatives by s, (M, 3) each.
        """
        cell = np.clip((s / self.step).astype(np.int64), 0, self.intervals - 1)
        u = (s / self.step - cell)[:, None]
        value = np.hstack([(1 - u) ** 2, 1 + 2 * u - 2 * u**2, u**2]) / 2
        slope = np.hstack([u - 1, 1 - 2 * u, u]) / self.step
        bend = np.broadcast_to(np.array([1.0, -2.0, 1.0]) / self.step**2, value.shape)
        return cell, value, slope, bend


@dataclass(frozen=True, kw_only=True, eq=False)
class SpeedLaw:
    """A timing of a path: (ds/dt)^2 = x(s) = sum_k coefficients[k] B_k(s), which is above zero.

    Args:
        grid: the splines.
        coefficients: (K+2,).
    """

    grid: SpeedGrid
    coefficients: Array

    def _squared(self, s: Array) -> tuple[Array, Array]:
        cell, value, slope, _ = self.grid.basis(s)
        near = self.coefficients[cell[:, None] + np.arange(3)]
        return (value * near).sum(axis=1), (slope * near).sum(axis=1)

    def _time_from(self, start: Array, s: Array) -> Array:
        """Time from `start` to `s` (M,) each, of which each pair lies within one interval."""
        half = (s - start) / 2
        points = start[:, None] + half[:, None] * (1 + _NODES)
        x, _ = self._squared(points.ravel())
        return half * (_WEIGHTS / np.sqrt(x.reshape(points.shape))).sum(axis=1)

    @property
    def knots(self) -> tuple[Array, Array]:
        """The ends of the intervals and the times there [s], (K+1,) each."""
        s = np.linspace(0.0, self.grid.length, self.grid.intervals + 1)
        return s, np.concatenate([[0.0], np.cumsum(self._time_from(s[:-1], s[1:]))])

    def sample(self, t: Array, stretch: float = 1.0) -> tuple[Array, Array, Array]:
        """Inverts the timing by Newton's method.

        Args:
            t: times, (N,) [s], clipped to the duration.
            stretch: factor on all times.

        Returns:
            s, ds/dt and d2s/dt2, (N,) each.
        """
        s_knots, t_knots = self.knots
        local = np.clip(t / stretch, 0.0, t_knots[-1])
        cell = np.clip(np.searchsorted(t_knots, local, side="right") - 1, 0, self.grid.intervals - 1)
        low, high = s_knots[cell], s_knots[cell + 1]
        s = low + (high - low) * (local - t_knots[cell]) / (t_knots[cell + 1] - t_knots[cell])
        for _ in range(4):
            x, _ = self._squared(s)
            s = np.clip(s - (t_knots[cell] + self._time_from(low, s) - local) * np.sqrt(x), low, high)
        x, slope = self._squared(s)
        return s, np.sqrt(x) / stretch, slope / 2 / stretch**2

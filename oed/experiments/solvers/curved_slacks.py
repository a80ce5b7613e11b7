"""How far a motion is within the limits that are not linear in its coefficients."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from oed.experiments.problems.pointwise_rows import MARGIN_BETWEEN_SAMPLES, mean_gradients, row_gradients
from oed.experiments.problems.problem import FourierProblem
from robots.common.arrays import Array

# How close to its bound, in its own scale, a peak is a row of the solver from the start.
NEAR = 0.05


class CurvedSlacks:
    """Slacks of the averaged limits, and of those pointwise limits and samples that a motion comes near.

    All limits at all samples decide whether a motion is within them (`values`); only some are rows, with derivatives.
    From each bound `MARGIN_BETWEEN_SAMPLES` is kept for what happens between the samples, or nine tenths of what the
    start keeps.

    Args:
        problem: the design problem.
        start: z (n K,), within all limits.
    """

    def __init__(self, problem: FourierProblem, start: Array) -> None:
        self._problem = problem
        lower = np.concatenate([np.zeros(0), *(limit.lower for limit in problem.pointwise)])
        upper = np.concatenate([np.zeros(0), *(limit.upper for limit in problem.pointwise)])
        # A side is one bound of one row: sign * value <= bound.
        self._row = np.concatenate([np.flatnonzero(np.isfinite(lower)), np.flatnonzero(np.isfinite(upper))])
        self._sign = np.repeat([-1.0, 1.0], [np.isfinite(lower).sum(), np.isfinite(upper).sum()])
        self._bound = self._sign * np.concatenate([lower[np.isfinite(lower)], upper[np.isfinite(upper)]])
        self._chosen = np.zeros((problem.limit_samples, len(self._row)), dtype=bool)
        self._at: tuple[NDArray[np.intp], NDArray[np.intp]] = (np.zeros(0, np.intp), np.zeros(0, np.intp))
        self._last: tuple[Array, tuple[Array, Array]] | None = None
        rooms = self._rooms(start)
        self._kept = (
            np.minimum(MARGIN_BETWEEN_SAMPLES, 0.9 * rooms[0]),
            np.minimum(MARGIN_BETWEEN_SAMPLES, 0.9 * rooms[1]),
        )
        self._slopes = np.zeros((0, problem.size))
        self.choose(start, NEAR)

    @property
    def size(self) -> int:
        """Number of rows."""
        return len(self._at[0]) + len(self._kept[1])

    def values(self, z: Array) -> tuple[Array, bool]:
        """Evaluates the rows' slacks; the flag says whether all other limits hold."""
        if not self._problem.curved:
            return np.zeros(0), True
        single, averaged = self._slacks(z)
        others = bool((single[~self._chosen] > 0).all())
        return np.concatenate([averaged, single[self._at]]), others

    def choose(self, z: Array, near: float = 0.0) -> bool:
        """Makes rows of the limits that come near their bound at z, at each peak; true if there are new ones."""
        if not self._problem.pointwise:
            return False
        single, _ = self._slacks(z)
        peak = (single <= np.roll(single, 1, 0)) & (single <= np.roll(single, -1, 0)) & (single <= near)
        samples, sides = np.nonzero(peak & ~self._chosen)
        self._chosen |= peak
        self._at = np.append(self._at[0], samples), np.append(self._at[1], sides)
        return len(samples) > 0

    def linearise(self, z: Array) -> None:
        """Takes the rows' derivatives at z."""
        if self._problem.curved:
            states = self._problem.limit_states(z)
            samples, sides = self._at
            single = row_gradients(self._problem, states, samples, self._row[sides])
            averaged = mean_gradients(self._problem, states)
            self._slopes = -np.concatenate([averaged, self._sign[sides, None] * single])

    def change(self, p: Array) -> Array:
        """Their change along a direction, to first order."""
        return self._slopes @ p

    def pullback(self, weights: Array) -> Array:
        """The gradient (n K,) of the slacks' weighted sum."""
        return weights @ self._slopes

    def add_normal(self, matrix: Array, weights: Array) -> None:
        """Adds sum_i w_i (ds_i/dz)(ds_i/dz)' to a matrix (n K, n K)."""
        matrix += (self._slopes * weights[:, None]).T @ self._slopes

    def _slacks(self, z: Array) -> tuple[Array, Array]:
        """Evaluates the slacks of all limits, rows or not, and remembers them: each point is asked for twice."""
        if self._last is None or not np.array_equal(self._last[0], z):
            single, averaged = self._rooms(z)
            self._last = z.copy(), (single - self._kept[0], averaged - self._kept[1])
        return self._last[1]

    def _rooms(self, z: Array) -> tuple[Array, Array]:
        """How far each side of the pointwise limits (M, S), and the averaged ones, are from their bounds."""
        problem = self._problem
        states = problem.limit_states(z)
        values = [limit.values(*states) for limit in problem.pointwise]
        single = np.concatenate([np.zeros((len(states[0]), 0)), *values], axis=1)[:, self._row]
        averaged = [1 - limit.values(*states) for limit in problem.averaged]
        return self._bound - self._sign * single, np.concatenate([np.zeros(0), *averaged])

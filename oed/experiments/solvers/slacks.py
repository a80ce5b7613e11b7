"""How far a motion is within each of its limits, and how that changes with the coefficients."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from oed.experiments.problems.pointwise_rows import BETWEEN, PointwiseRows
from oed.experiments.problems.problem import FourierProblem

Array = NDArray[np.float64]


class LinearSlacks:
    """1 - r and 1 + r for all kinematic rows -1 <= r = A z + b <= 1 of all joints, imposed at every limit sample.

    Rows that Bernstein's inequality implies are left out: a trigonometric polynomial of degree N satisfies
    max |p'| <= N w max |p - c|, so that a range that is short for its velocity limit keeps it of itself, and likewise
    velocity for acceleration and acceleration for jerk.

    Args:
        problem: the design problem.
    """

    def __init__(self, problem: FourierProblem) -> None:
        rows, samples = problem.rows, problem.limit_samples
        self._joints, self._each = problem.joints, problem.size // problem.joints
        limited = np.isfinite(rows.upper)  # (n, R)
        centre = np.where(limited, (rows.upper + np.where(limited, rows.lower, 0)) / 2, 0)
        half = np.where(limited, rows.upper - centre, 1.0)
        kept = limited & ~implied(problem)
        used = kept.any(axis=0)
        matrix = rows.matrix * problem.scale[:, None, :] / half[:, :, None]
        offset = (problem.centre[:, None] * rows.matrix[:, 0] - centre) / half
        # A row that a joint has not is zero, half-way between its bounds always.
        self._rows = np.ascontiguousarray(np.where(kept[:, :, None], matrix, 0.0)[:, used])  # (n, R', K)
        self._columns = np.ascontiguousarray(self._rows.transpose(0, 2, 1))
        self._offset = np.where(kept, offset, 0.0)[:, used]
        self.size = 2 * self._offset.size
        self.samples = samples

    def values(self, z: Array) -> Array:
        """Evaluates both slacks of each row (2 n R',)."""
        r = (self._rows @ z.reshape(self._joints, self._each, 1))[:, :, 0] + self._offset
        return np.concatenate([(1 - r).ravel(), (1 + r).ravel()])

    def change(self, p: Array) -> Array:
        """Their change along a direction (n K,)."""
        r = (self._rows @ p.reshape(self._joints, self._each, 1))[:, :, 0].ravel()
        return np.concatenate([-r, r])

    def pullback(self, weights: Array) -> Array:
        """The gradient (n K,) of the slacks' weighted sum."""
        upper, lower = weights.reshape(2, self._joints, -1)
        return (self._columns @ (lower - upper)[:, :, None]).ravel()

    def add_normal(self, matrix: Array, weights: Array) -> None:
        """Adds sum_i w_i (ds_i/dz)(ds_i/dz)' to a matrix (n K, n K)."""
        upper, lower = weights.reshape(2, self._joints, -1)
        blocks = (self._columns * (upper + lower)[:, None, :]) @ self._rows
        for joint, block in enumerate(blocks):
            part = slice(joint * self._each, (joint + 1) * self._each)
            matrix[part, part] += block


class Slacks:
    """Those of the linear rows, then those of the chosen pointwise rows, which bend.

    Args:
        linear: slacks of the kinematic rows.
        curved: the pointwise rows chosen at the moment.
        start: z (n K,), strictly within all of them.
    """

    def __init__(self, linear: LinearSlacks, curved: PointwiseRows, start: Array) -> None:
        self._linear, self._curved = linear, curved
        self.bent = curved.size > 0
        if self.bent:
            lower, upper = curved.bounds()
            self._has_lower, self._has_upper = np.isfinite(lower), np.isfinite(upper)
            self._lower, self._upper = lower[self._has_lower], upper[self._has_upper]
            # A start may be nearer to a bound than what is kept from it; it may go a tenth of the way there.
            room = self._from_bounds(curved.values(start))
            self._relaxed = np.maximum(0.0, (room + BETWEEN) / 10 - room)
        self._slopes = np.zeros((0, len(start)))

    def _from_bounds(self, values: Array) -> Array:
        return np.concatenate([values[self._has_lower] - self._lower, self._upper - values[self._has_upper]])

    def values(self, z: Array) -> Array:
        """Evaluates all slacks (m,)."""
        linear = self._linear.values(z)
        if not self.bent:
            return linear
        return np.concatenate([linear, self._from_bounds(self._curved.values(z)) + self._relaxed])

    def linearise(self, z: Array) -> None:
        """Takes the derivatives of the pointwise rows at z."""
        if self.bent:
            slopes = self._curved.jacobian(z)
            self._slopes = np.concatenate([slopes[self._has_lower], -slopes[self._has_upper]])

    def change(self, p: Array) -> Array:
        """Their change along a direction, to first order (m,)."""
        linear = self._linear.change(p)
        return np.concatenate([linear, self._slopes @ p]) if self.bent else linear

    def pullback(self, weights: Array) -> Array:
        """The gradient (n K,) of the slacks' weighted sum."""
        linear = self._linear.pullback(weights[: self._linear.size])
        return linear + self.bend(weights) if self.bent else linear

    def bend(self, weights: Array) -> Array:
        """That of the pointwise rows alone."""
        return np.asarray(weights[self._linear.size :] @ self._slopes, dtype=np.float64)

    def add_normal(self, matrix: Array, weights: Array) -> None:
        """Adds sum_i w_i (ds_i/dz)(ds_i/dz)' to a matrix (n K, n K)."""
        self._linear.add_normal(matrix, weights[: self._linear.size])
        if self.bent:
            matrix += (self._slopes * weights[self._linear.size :, None]).T @ self._slopes


def implied(problem: FourierProblem) -> NDArray[np.bool_]:
    """Marks the rows (n, R) that the rows of the quantity before keep by Bernstein's inequality."""
    rows, samples = problem.rows, problem.limit_samples
    half = (rows.upper - rows.lower)[:, ::samples] / 2  # (n, quantities), the same for all samples
    order = [("q", "dq", "ddq", "dddq").index(rows.labels[i][0]) for i in range(0, len(rows.labels), samples)]
    fastest = 2 * np.pi * problem.base_frequency * problem.harmonics
    marks = np.zeros(half.shape, dtype=bool)
    for number in range(1, len(order)):
        follows = order[number] == order[number - 1] + 1
        marks[:, number] = follows & (fastest * half[:, number - 1] <= half[:, number])
    return np.repeat(marks, samples, axis=1)

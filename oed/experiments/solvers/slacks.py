"""How far a motion is within each of its limits, and how that changes with the coefficients."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from oed.experiments.problems.problem import FourierProblem
from oed.experiments.solvers.curved_slacks import CurvedSlacks
from robots.common.arrays import Array


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
    """Those of the linear rows, then those of the curved ones.

    Args:
        linear: slacks of the kinematic rows.
        curved: those of all other limits.
    """

    def __init__(self, linear: LinearSlacks, curved: CurvedSlacks) -> None:
        self._linear, self._curved = linear, curved

    def values(self, z: Array) -> tuple[Array, bool]:
        """Evaluates the rows' slacks (m,), with a flag: all limits that are no rows hold."""
        linear = self._linear.values(z)
        curved, others = self._curved.values(z)
        return np.concatenate([linear, curved]), others

    def choose(self, z: Array) -> bool:
        """Makes rows of limits passed at z; see `CurvedSlacks.choose`."""
        return self._curved.choose(z)

    def linearise(self, z: Array) -> None:
        """Takes the derivatives at z."""
        self._curved.linearise(z)

    def change(self, p: Array) -> Array:
        """Their change along a direction, to first order (m,)."""
        return np.concatenate([self._linear.change(p), self._curved.change(p)])

    def pullback(self, weights: Array) -> Array:
        """The gradient (n K,) of the slacks' weighted sum."""
        return self._linear.pullback(weights[: self._linear.size]) + self.bend(weights)

    def bend(self, weights: Array) -> Array:
        """That of the curved rows alone."""
        return self._curved.pullback(weights[self._linear.size :])

    def add_normal(self, matrix: Array, weights: Array) -> None:
        """Adds sum_i w_i (ds_i/dz)(ds_i/dz)' to a matrix (n K, n K)."""
        self._linear.add_normal(matrix, weights[: self._linear.size])
        self._curved.add_normal(matrix, weights[self._linear.size :])


def implied(problem: FourierProblem) -> NDArray[np.bool_]:
    """Marks the rows (n, R) that the rows of the quantity before keep by Bernstein's inequality."""
    rows, samples = problem.rows, problem.limit_samples
    half = (rows.upper - rows.lower)[:, ::samples] / 2  # (n, quantities), the same for all samples
    order = [("q", "dq", "ddq", "dddq").index(rows.labels[i][0]) for i in range(0, len(rows.labels), samples)]
    fastest = problem.family.fastest
    marks = np.zeros(half.shape, dtype=bool)
    for number in range(1, len(order) if np.isfinite(fastest) else 0):
        follows = order[number] == order[number - 1] + 1
        marks[:, number] = follows & (fastest * half[:, number - 1] <= half[:, number])
    return np.repeat(marks, samples, axis=1)

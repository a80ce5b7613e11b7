"""The pointwise limits as rows of the solver: only where a motion comes near them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from oed.experiments.problems.problem import FourierProblem
from robots.common.arrays import Array

Indices = NDArray[np.intp]
States = tuple[Array, Array, Array]

# Kept from each bound, in its own scale, for what happens between the samples.
MARGIN_BETWEEN_SAMPLES = 0.005


class PointwiseRows:
    """Chosen (sample, row) pairs of the pointwise limits, all averaged ones, and their exact derivatives by z.

    Args:
        problem: the design problem; with no pointwise limits there are no rows.
        near: how close to a bound, in its own scale, a peak must come to be chosen.
    """

    def __init__(self, problem: FourierProblem, near: float = 0.01) -> None:
        self._problem, self._near = problem, near
        count = sum(len(limit.labels) for limit in problem.pointwise)
        self._chosen = np.zeros((problem.limit_samples, count), dtype=bool)
        self._averaged = sum(len(limit.labels) for limit in problem.averaged)

    @property
    def size(self) -> int:
        """Number of rows chosen."""
        return int(self._chosen.sum()) + self._averaged

    def add_peaks(self, z: Array, tolerance: float) -> bool:
        """Adds the sample of each near peak; returns whether one exceeded its bound by more than the tolerance."""
        if not self._problem.pointwise:
            return False
        excess = self._problem.pointwise_excess(z)
        peak = (excess >= np.roll(excess, 1, 0)) & (excess > np.roll(excess, -1, 0)) & (excess > -self._near)
        # One row a peak: each costs IPOPT a dense one.
        passed = bool((excess[peak & ~self._chosen] > tolerance).any())
        self._chosen |= peak
        return passed

    def bounds(self) -> tuple[Array, Array]:
        """Lower and upper bounds of the chosen rows."""
        limits = self._problem.pointwise
        lower = np.concatenate([limit.lower for limit in limits]) if limits else np.zeros(0)
        upper = np.concatenate([limit.upper for limit in limits]) if limits else np.zeros(0)
        columns = np.nonzero(self._chosen)[1]
        lower = np.append(lower[columns], np.full(self._averaged, -np.inf))
        upper = np.append(upper[columns], np.ones(self._averaged))
        return lower + MARGIN_BETWEEN_SAMPLES, upper - MARGIN_BETWEEN_SAMPLES

    def values(self, z: Array) -> Array:
        """Evaluates the chosen rows."""
        states = self._problem.limit_states(z)
        whole = [limit.values(*states) for limit in self._problem.averaged]
        rows = np.flatnonzero(self._chosen.any(axis=1))
        if not len(rows):
            return np.concatenate([np.zeros(0), *whole])
        values = [limit.values(*(state[rows] for state in states)) for limit in self._problem.pointwise]
        return np.concatenate([np.concatenate(values, axis=1)[self._chosen[rows]], *whole])

    def jacobian(self, z: Array) -> Array:
        """Evaluates the derivatives (rows, n K) of the chosen rows by z."""
        states = self._problem.limit_states(z)
        samples, rows = np.nonzero(self._chosen)
        return np.concatenate(
            [row_gradients(self._problem, states, samples, rows), mean_gradients(self._problem, states)]
        )


def row_gradients(problem: FourierProblem, states: States, samples: Indices, rows: Indices) -> Array:
    """Evaluates the derivatives (m, n K) of single rows of the pointwise limits by z.

    Args:
        problem: the design problem.
        states: position, velocity and acceleration at all limit samples, as `FourierProblem.limit_states` gives them.
        samples: which limit sample each of them is at (m,).
        rows: which row of all pointwise limits it is (m,).
    """
    gradients, first = np.zeros((len(samples), problem.joints, problem.family.size)), 0
    for limit in problem.pointwise:
        # Each limit is differentiated only at the samples of its own rows.
        own = np.flatnonzero((rows >= first) & (rows < first + len(limit.labels)))
        if len(own):
            used, where = np.unique(samples[own], return_inverse=True)
            by_state = limit.jacobian(*(state[used] for state in states))
            slopes = by_state[where, rows[own] - first].reshape(-1, 3, problem.joints)  # by q, dq, ddq of each joint
            gradients[own] = np.swapaxes(slopes, 1, 2) @ problem.state_basis[samples[own]]
        first += len(limit.labels)
    return np.asarray((gradients * problem.scale).reshape(-1, problem.size), dtype=np.float64)


def mean_gradients(problem: FourierProblem, states: States) -> Array:
    """Evaluates the derivatives (A, n K) of all averaged limits by z."""
    bases = problem.state_basis
    whole = [np.zeros((0, problem.size))]
    for limit in problem.averaged:
        each = limit.jacobian(*states).reshape(len(limit.labels), len(bases), 3, problem.joints)
        summed = np.einsum("rmdj,mdk->rjk", each, bases, optimize=True) * problem.scale
        whole.append(summed.reshape(len(limit.labels), -1))
    return np.concatenate(whole)

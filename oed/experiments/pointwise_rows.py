"""The pointwise limits as rows of the solver: only where a motion comes near them."""

# ruff: noqa: D102 -- CasADi prescribes the callbacks' methods

from __future__ import annotations

from collections.abc import Sequence

import casadi
import numpy as np
from numpy.typing import NDArray

from oed.experiments.problem import FourierProblem
from oed.experiments.trap import Trap

Array = NDArray[np.float64]

# Kept from each bound, in its own scale, for what happens between the samples.
BETWEEN = 0.005


class PointwiseRows:
    """Chosen (sample, row) pairs of the pointwise limits, and their exact derivatives by z.

    Args:
        problem: the design problem; with no pointwise limits there are no rows.
        near: how close to a bound, in its own scale, a peak must come to be chosen.
    """

    def __init__(self, problem: FourierProblem, near: float = 0.01) -> None:
        self._problem, self._near = problem, near
        count = sum(len(limit.labels) for limit in problem.pointwise)
        self._chosen = np.zeros((problem.limit_samples, count), dtype=bool)

    @property
    def size(self) -> int:
        """Number of rows chosen."""
        return int(self._chosen.sum())

    def add_peaks(self, z: Array, tolerance: float) -> bool:
        """Adds the sample of each near peak; tells whether one passed its bound by more than the tolerance."""
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
        return lower[columns] + BETWEEN, upper[columns] - BETWEEN

    def values(self, z: Array) -> Array:
        """Evaluates the chosen rows."""
        states = self._problem.limit_states(z)
        rows = np.flatnonzero(self._chosen.any(axis=1))
        values = [limit.values(*(state[rows] for state in states)) for limit in self._problem.pointwise]
        return np.concatenate(values, axis=1)[self._chosen[rows]]

    def jacobian(self, z: Array) -> Array:
        """Evaluates the derivatives (rows, n K) of the chosen rows by z."""
        problem = self._problem
        states = problem.limit_states(z)
        samples = np.flatnonzero(self._chosen.any(axis=1))
        by_state = np.concatenate(
            [limit.jacobian(*(state[samples] for state in states)) for limit in problem.pointwise], axis=1
        )
        chosen = self._chosen[samples]
        slopes = by_state[chosen].reshape(-1, 3, problem.joints)  # per row: by q, dq, ddq of each joint
        at = samples[np.nonzero(chosen)[0]]
        bases = np.stack([basis[at] for basis in problem.limit_bases[:3]], axis=1)  # (rows, 3, K)
        gradient = np.einsum("rdj,rdk->rjk", slopes, bases) * problem.scale
        return gradient.reshape(len(at), -1)


class PointwiseFunction(casadi.Callback):
    """The chosen rows as a CasADi function with an exact Jacobian."""

    def __init__(self, rows: PointwiseRows, size: int, trap: Trap) -> None:
        casadi.Callback.__init__(self)
        self.trap = trap
        self.rows, self.variables, self.outputs = rows, size, rows.size
        self._jacobian = _Jacobian(self)
        self.construct("pointwise", {"enable_fd": False})

    def get_sparsity_in(self, _: int) -> casadi.Sparsity:
        return casadi.Sparsity.dense(self.variables, 1)

    def get_sparsity_out(self, _: int) -> casadi.Sparsity:
        return casadi.Sparsity.dense(self.outputs, 1)

    def eval(self, arguments: Sequence[casadi.DM]) -> list[casadi.DM]:
        z = np.array(arguments[0].nonzeros())
        return [casadi.DM(self.trap.call(lambda: self.rows.values(z), np.zeros(self.outputs)))]

    def has_jacobian(self) -> bool:
        return True

    def get_jacobian(self, *_: object) -> casadi.Function:
        return self._jacobian


class _Jacobian(casadi.Callback):
    def __init__(self, function: PointwiseFunction) -> None:
        casadi.Callback.__init__(self)
        self._rows, self._trap = function.rows, function.trap
        self._variables, self._outputs = function.variables, function.outputs
        self.construct("pointwise_jacobian", {"enable_fd": False})

    def get_n_in(self) -> int:
        return 2

    def get_sparsity_in(self, index: int) -> casadi.Sparsity:
        return casadi.Sparsity.dense(self._variables if index == 0 else self._outputs, 1)

    def get_sparsity_out(self, _: int) -> casadi.Sparsity:
        return casadi.Sparsity.dense(self._outputs, self._variables)

    def eval(self, arguments: Sequence[casadi.DM]) -> list[casadi.DM]:
        z = np.array(arguments[0].nonzeros())
        return [casadi.DM(self._trap.call(lambda: self._rows.jacobian(z), np.zeros((self._outputs, self._variables))))]

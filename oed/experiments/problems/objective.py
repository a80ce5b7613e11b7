"""A design problem's criterion as CasADi functions, with exact gradients and no conversion of large arrays."""

# ruff: noqa: D102 -- CasADi prescribes the callbacks' methods

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol

import casadi
import numpy as np

from oed.experiments.problems.trap import Trap
from robots.common.arrays import Array


class Smooth(Protocol):
    """A problem with a smooth stand-in for its criterion."""

    @property
    def size(self) -> int:
        """Number of variables."""

    def surrogate(self, z: Array, sharpness: float) -> tuple[float, Array]:
        """Gives the stand-in and its gradient (size,)."""


class Objective(casadi.Callback):
    """The smooth stand-in as a CasADi function; value and gradient are computed together and remembered."""

    def __init__(self, problem: Smooth, trap: Trap) -> None:
        casadi.Callback.__init__(self)
        self.problem, self.sharpness, self.evaluations = problem, 1.0, 0
        self._trap = trap
        self._at: Array | None = None
        self._known: tuple[float, Array] = (0.0, np.zeros(problem.size))
        self._gradient = Gradient(self)
        self.construct("criterion", {"enable_fd": False})

    def evaluate(self, z: casadi.DM) -> tuple[float, Array]:
        """Gives value and gradient (n K,); those of the last point if the criterion fails."""
        self._known = self._trap.call(lambda: self._evaluated(np.array(z.nonzeros())), self._known)
        return self._known

    def _evaluated(self, point: Array) -> tuple[float, Array]:
        if self._at is not None and np.array_equal(self._at, point):
            return self._known
        known = self.problem.surrogate(point, self.sharpness)
        self._at = point
        self.evaluations += 1
        return known

    def forget(self, sharpness: float) -> None:
        """Changes to a stand-in of that sharpness."""
        self.sharpness, self._at = sharpness, None

    # What CasADi asks a callback for.

    def get_sparsity_in(self, _: int) -> casadi.Sparsity:
        return casadi.Sparsity.dense(self.problem.size, 1)

    def eval(self, arguments: Sequence[casadi.DM]) -> list[casadi.DM]:
        return [casadi.DM(self.evaluate(arguments[0])[0])]

    def has_jacobian(self) -> bool:
        return True

    def get_jacobian(self, *_: object) -> casadi.Function:
        return self._gradient


class Gradient(casadi.Callback):
    """The exact gradient of `Objective`, as the row vector that CasADi asks for."""

    def __init__(self, objective: Objective) -> None:
        casadi.Callback.__init__(self)
        self._objective = objective
        self._size = objective.problem.size
        self.construct("gradient", {"enable_fd": False})

    def get_n_in(self) -> int:
        return 2

    def get_sparsity_in(self, index: int) -> casadi.Sparsity:
        return casadi.Sparsity.dense(self._size if index == 0 else 1, 1)

    def get_sparsity_out(self, _: int) -> casadi.Sparsity:
        return casadi.Sparsity.dense(1, self._size)

    def eval(self, arguments: Sequence[casadi.DM]) -> list[casadi.DM]:
        return [casadi.DM(self._objective.evaluate(arguments[0])[1]).T]


class Watch(casadi.Callback):
    """Asks after each iteration whether to go on; returning 1 stops IPOPT, which keeps its last iterate."""

    def __init__(self, size: int, rows: int, go_on: Callable[[float], bool], trap: Trap) -> None:
        casadi.Callback.__init__(self)
        self._shapes = {"x": size, "f": 1, "g": rows, "lam_x": size, "lam_g": rows, "lam_p": 0}
        self._go_on, self._trap = go_on, trap
        self.construct("watch", {})

    def get_n_in(self) -> int:
        return casadi.nlpsol_n_out()

    def get_name_in(self, index: int) -> str:
        return casadi.nlpsol_out(index)

    def get_sparsity_in(self, index: int) -> casadi.Sparsity:
        return casadi.Sparsity.dense(self._shapes[casadi.nlpsol_out(index)], 1)

    def eval(self, arguments: Sequence[casadi.DM]) -> list[casadi.DM]:
        return [casadi.DM(0.0 if self._trap.call(lambda: self._go_on(float(arguments[1])), False) else 1.0)]

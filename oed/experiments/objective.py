"""A design problem's criterion as CasADi functions, with exact gradients and no conversion of large arrays."""

from __future__ import annotations

from collections.abc import Callable

import casadi
import numpy as np
from numpy.typing import NDArray

from oed.experiments.problem import FourierProblem

Array = NDArray[np.float64]


class Objective(casadi.Callback):  # type: ignore[misc]
    """The smooth stand-in as a CasADi function; value and gradient are computed together and remembered."""

    def __init__(self, problem: FourierProblem) -> None:
        casadi.Callback.__init__(self)
        self.problem, self.sharpness, self.evaluations = problem, 1.0, 0
        self._at: Array | None = None
        self._known: tuple[float, Array] = (0.0, np.zeros(0))
        self._gradient = Gradient(self)
        self.construct("criterion", {"enable_fd": False})

    def get_sparsity_in(self, _: int) -> casadi.Sparsity:
        return casadi.Sparsity.dense(self.problem.size, 1)

    def evaluate(self, z: casadi.DM) -> tuple[float, Array]:
        point = np.array(z.nonzeros())
        if self._at is None or not np.array_equal(self._at, point):
            self._known = self.problem.surrogate(point, self.sharpness)
            self._at = point
            self.evaluations += 1
        return self._known

    def forget(self, sharpness: float) -> None:
        self.sharpness, self._at = sharpness, None

    def eval(self, arguments: list[casadi.DM]) -> list[float]:
        return [self.evaluate(arguments[0])[0]]

    def has_jacobian(self) -> bool:
        return True

    def get_jacobian(self, *_: object) -> casadi.Function:
        return self._gradient


class Gradient(casadi.Callback):  # type: ignore[misc]
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

    def eval(self, arguments: list[casadi.DM]) -> list[casadi.DM]:
        return [casadi.DM(self._objective.evaluate(arguments[0])[1]).T]


class Watch(casadi.Callback):  # type: ignore[misc]
    """Counts iterations for the progress bar; returning 1 stops IPOPT, which keeps its last iterate."""

    def __init__(self, size: int, rows: int, tell: Callable[[], bool]) -> None:
        casadi.Callback.__init__(self)
        self._shapes = {"x": size, "f": 1, "g": rows, "lam_x": size, "lam_g": rows, "lam_p": 0}
        self._tell = tell
        self.construct("watch", {})

    def get_n_in(self) -> int:
        return casadi.nlpsol_n_out()

    def get_name_in(self, index: int) -> str:
        return casadi.nlpsol_out(index)

    def get_sparsity_in(self, index: int) -> casadi.Sparsity:
        return casadi.Sparsity.dense(self._shapes[casadi.nlpsol_out(index)], 1)

    def eval(self, arguments: list[casadi.DM]) -> list[float]:
        return [0.0 if self._tell() else 1.0]

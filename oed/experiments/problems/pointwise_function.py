"""The pointwise limits' rows as CasADi functions, for IPOPT."""

# ruff: noqa: D102 -- CasADi prescribes the callbacks' methods

from __future__ import annotations

from collections.abc import Sequence

import casadi
import numpy as np

from oed.experiments.problems.pointwise_rows import PointwiseRows
from oed.experiments.problems.trap import Trap


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

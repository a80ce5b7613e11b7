"""Convex programs handed to Clarabel directly: what a modelling layer would take longer to write than to solve."""

from __future__ import annotations

import numpy as np
from scipy import sparse

from robots.common.arrays import Array
from robots.common.errors import InfeasibleError, SolverError


class ConicProgram:
    """min x'Px/2 + q'x with affine images of x in cones.

    Args:
        size: number of variables.
    """

    def __init__(self, size: int) -> None:
        self.size = size
        self._nonnegative: list[tuple[sparse.csc_matrix, Array]] = []
        self._equal: list[tuple[sparse.csc_matrix, Array]] = []
        self._semidefinite: list[tuple[sparse.csc_matrix, Array, int]] = []
        self._exponential: list[tuple[sparse.csc_matrix, Array]] = []

    def equal(self, matrix: Array, offset: Array) -> None:
        """Demands matrix x + offset = 0, matrix (m, size)."""
        self._equal.append((sparse.csc_matrix(matrix), np.asarray(offset, dtype=float)))

    def nonnegative(self, matrix: Array, offset: Array) -> None:
        """Demands matrix x + offset >= 0, matrix (m, size)."""
        self._nonnegative.append((sparse.csc_matrix(matrix), np.asarray(offset, dtype=float)))

    def semidefinite(self, basis: Array, offset: Array) -> None:
        """Demands sum_k x_k basis[k] + offset >= 0 as a matrix, basis (size, d, d) and offset (d, d) symmetric."""
        d = offset.shape[0]
        columns, rows = np.tril_indices(d)  # the upper triangle, column by column
        factor = np.where(rows == columns, 1.0, np.sqrt(2.0))
        matrix = (basis[:, rows, columns] * factor).T
        self._semidefinite.append((sparse.csc_matrix(matrix), offset[rows, columns] * factor, d))

    def exponential(self, matrix: Array, offset: Array) -> None:
        """Demands y exp(u / y) <= z of (u, y, z) = matrix x + offset, matrix (3, size)."""
        self._exponential.append((sparse.csc_matrix(matrix), np.asarray(offset, dtype=float)))

    def solve(self, quadratic: Array, linear: Array, what: str) -> Array:
        """Solves.

        Args:
            quadratic: P (size, size), positive semidefinite.
            linear: q (size,).
            what: is solved for, for messages.

        Returns:
            x (size,).

        Raises:
            InfeasibleError: no x obeys the constraints.
            SolverError: the solver gave up.
        """
        import clarabel

        parts = [*self._equal, *self._nonnegative, *((m, o) for m, o, _ in self._semidefinite), *self._exponential]
        zeros, positives = (sum(len(o) for _, o in group) for group in (self._equal, self._nonnegative))
        cones = [
            *([clarabel.ZeroConeT(zeros)] if zeros else []),
            *([clarabel.NonnegativeConeT(positives)] if positives else []),
            *(clarabel.PSDTriangleConeT(d) for _, _, d in self._semidefinite),
            *(clarabel.ExponentialConeT() for _ in self._exponential),
        ]
        if parts:
            matrix = sparse.vstack([-m for m, _ in parts]).tocsc()
            offset = np.concatenate([o for _, o in parts])
        else:
            matrix, offset = sparse.csc_matrix((0, self.size)), np.zeros(0)
        # The objective's own scale is no business of the stopping rule.
        scale = 1 / max(float(np.abs(linear).max(initial=0.0)), float(np.abs(quadratic).max(initial=0.0)), 1e-300)
        settings = clarabel.DefaultSettings()
        settings.verbose = False
        settings.max_threads = 1
        # A weak prior on undetermined directions is far below the data's cost, but must still be resolved.
        settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = 1e-10
        upper = sparse.triu(sparse.csc_matrix(scale * quadratic)).tocsc()
        solution = clarabel.DefaultSolver(upper, scale * linear, matrix, offset, cones, settings).solve()
        status = str(solution.status)
        if status in ("PrimalInfeasible", "AlmostPrimalInfeasible"):
            raise InfeasibleError(f"{what}: no parameters obey all constraints", remedy="relax the bounds")
        if status not in ("Solved", "AlmostSolved"):
            raise SolverError(f"{what}: Clarabel ended with {status}", remedy="check the data and the bounds")
        return np.asarray(solution.x)

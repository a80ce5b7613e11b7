"""The log determinant of a pseudo-inertia in a conic program."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from estimation.linear_algebra.conic import ConicProgram
from robots.common.arrays import Array
from robots.consistency import BASIS

LOG_DETERMINANT_VARIABLES = 14
"""Further variables that the log determinant of one body takes."""


def add_log_determinant(
    program: ConicProgram, linear: Array, columns: Sequence[int] | NDArray[np.intp], start: int, weight: float
) -> None:
    """Adds ``-weight log det P`` to an objective, P the pseudo-inertia of ten variables.

    With Z lower triangular and ``[[P, Z], [Z', diag(Z)]] >= 0``, ``det P >= prod diag(Z)``.

    Args:
        program: the program; it gets the constraints.
        linear: of the objective (size,); it gets the weight.
        columns: the variables that are the body's inertial parameters (10,).
        start: the first of `LOG_DETERMINANT_VARIABLES` variables that nothing else uses.
        weight: positive.
    """
    basis = np.zeros((program.size, 8, 8))
    basis[np.asarray(columns), :4, :4] = BASIS
    diagonal = []
    for offset, (i, j) in enumerate(zip(*np.tril_indices(4), strict=True)):
        k = start + offset
        basis[k, i, 4 + j] = basis[k, 4 + j, i] = 1.0
        if i == j:
            basis[k, 4 + i, 4 + i] = 1.0
            diagonal.append(k)
    program.semidefinite(basis, np.zeros((8, 8)))
    for offset, k in enumerate(diagonal):
        logarithm = start + 10 + offset
        linear[logarithm] -= weight
        matrix = np.zeros((3, program.size))
        matrix[0, logarithm] = matrix[2, k] = 1.0
        program.exponential(matrix, np.array([0.0, 1.0, 0.0]))

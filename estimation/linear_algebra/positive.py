"""Systems with a symmetric, positive definite matrix."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dposv

Array = NDArray[np.float64]


def solve_positive(matrix: Array, right: Array) -> Array:
    """Solves matrix x = right by Cholesky's factorisation.

    Straight to LAPACK: of matrices of some seventy columns scipy's checks take longer than the arithmetic, and a choice
    among settings solves a thousand of them.

    Args:
        matrix: symmetric (p, p).
        right: (p,) or (p, k).

    Returns:
        x, of the right side's shape.

    Raises:
        numpy.linalg.LinAlgError: a matrix that is not positive definite, or not finite.
    """
    # The transpose is what LAPACK wants of a C-ordered array, and the same matrix.
    _, solution, fault = dposv(matrix.T, right)
    if fault:
        raise np.linalg.LinAlgError(f"the leading minor of order {fault} is not positive definite")
    # LAPACK lets what is not a number through.
    if not np.isfinite(solution).all():
        raise np.linalg.LinAlgError("the matrix or the right side is not finite")
    return np.asarray(solution)

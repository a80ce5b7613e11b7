"""Systems with a symmetric, positive definite matrix."""

from __future__ import annotations

import numpy as np
from scipy.linalg.lapack import dposv

from robots.common.arrays import Array


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


def solve_nearly_positive(matrix: Array, right: Array) -> Array:
    """Solves matrix x = right as `solve_positive` does; by least squares where rounding made the matrix indefinite.

    Args:
        matrix: symmetric, with a diagonal of about one (p, p).
        right: (p,) or (p, k).

    Raises:
        numpy.linalg.LinAlgError: a matrix that is not finite.
    """
    try:
        return solve_positive(matrix, right)
    except np.linalg.LinAlgError:
        # The values differ by twelve orders of magnitude.
        return np.asarray(np.linalg.lstsq(matrix, right, rcond=1e-9)[0])

"""Normal equations whose parameters have very different scales."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

Array = NDArray[np.float64]

# Least regularisation that keeps the inverse finite.
FAINT = 1e-12
# Information below which a parameter acts on no torque; its variance would overflow.
SILENT = 1e-280


def inverse_of(information: Array) -> Array:
    """Inverts an information matrix.

    Args:
        information: (p, p), symmetric and positive semidefinite.

    Returns:
        The covariance (p, p). A parameter about which the logs say nothing has an infinite variance.
    """
    known = np.diag(information) > SILENT
    inverse = np.diag(np.where(known, 0.0, np.inf))
    inside = np.ix_(known, known)
    inverse[inside] = solve_normal(information[inside], np.eye(int(known.sum())))
    return inverse


def solve_normal(matrix: Array, right: Array) -> Array:
    """Solves normal equations, scaled to a diagonal of ones.

    Args:
        matrix: (p, p), symmetric and positive semidefinite.
        right: (p,) or (p, k).

    Returns:
        The solution, in the shape of the right-hand side.
    """
    scale = np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    scaled = matrix / scale[:, None] / scale + FAINT * np.eye(len(scale))
    solved = cho_solve(cho_factor(scaled), right / (scale if right.ndim == 1 else scale[:, None]))
    return np.asarray(solved / scale if right.ndim == 1 else solved / scale[:, None])

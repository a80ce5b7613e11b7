"""Symmetric matrices whose rows have different units: each is brought to a diagonal of ones before it is inverted."""

from __future__ import annotations

import numpy as np

from estimation.linear_algebra.positive import solve_nearly_positive
from robots.common.arrays import Array

# Ridge for columns of unit length that keeps any matrix invertible, far below what data say.
LEAST_RIDGE = 1e-12


def lengths(matrix: Array) -> Array:
    """Gives the roots of the diagonals (..., p) of Gram matrices (..., p, p), 1 for a column that is zero."""
    scale = np.sqrt(np.maximum(np.einsum("...kk->...k", matrix), 0.0))
    return np.where(scale > 0, scale, 1.0)


def solve_ridge(matrix: Array, right: Array, ridge: float) -> Array:
    """Solves normal equations with a ridge for columns of unit length.

    Args:
        matrix: positive semidefinite up to rounding (p, p).
        right: (p,) or (p, k).
        ridge: added to the diagonal of ones.

    Returns:
        The solution, in the shape of the right-hand side.
    """
    scale = lengths(matrix)
    across = scale.reshape((-1,) + (1,) * (right.ndim - 1))
    scaled = matrix / scale[:, None] / scale
    scaled[np.diag_indices_from(scaled)] += ridge
    return np.asarray(solve_nearly_positive(scaled, right / across) / across)


def inverse(matrix: Array, ridge: float = 0.0) -> Array:
    """Inverts a regular matrix (p, p), with a ridge for columns of unit length.

    Raises:
        numpy.linalg.LinAlgError: a singular matrix.
    """
    scale = lengths(matrix)
    found = np.linalg.inv(matrix / scale[:, None] / scale + ridge * np.eye(len(scale))) / scale[:, None] / scale
    return np.asarray((found + found.T) / 2)


def floored_inverse(matrix: Array) -> Array:
    """Inverts a matrix (p, p) whose eigenvalues below rounding count as rounding: the inverse is positive definite."""
    scale = lengths(matrix)
    values, vectors = np.linalg.eigh(matrix / scale[:, None] / scale)
    values = np.maximum(values, np.finfo(float).eps * len(values) * values[-1])
    return np.asarray((vectors / values) @ vectors.T / scale[:, None] / scale)


def inverse_root(matrix: Array, faint: float) -> Array:
    """Gives R (p, r) so that R R' is the inverse of a matrix (p, p) in the directions that it determines.

    Args:
        matrix: positive semidefinite.
        faint: directions whose eigenvalue is below this share of the largest are left out.
    """
    scale = lengths(matrix)
    values, vectors = np.linalg.eigh(matrix / scale[:, None] / scale)
    kept = values > faint * values[-1]
    return np.asarray(vectors[:, kept] / np.sqrt(values[kept]) / scale[:, None])


def square_root(matrix: Array) -> Array:
    """Gives R (p, p) so that R R' is a matrix (p, p) that is positive semidefinite up to rounding."""
    values, vectors = np.linalg.eigh(matrix)
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))

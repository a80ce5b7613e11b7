"""Orthonormal bases of tall matrices."""

from __future__ import annotations

import numpy as np

from robots.common.arrays import Array


def orthonormal(matrix: Array, faint: float) -> Array:
    """Gives an orthonormal basis of the columns, directions below a share `faint` of the largest left out.

    By the Gram matrix, twice: the first pass loses half the digits of faint directions, the second gives them back.
    """
    norms = np.linalg.norm(matrix, axis=0)
    basis = matrix[:, norms > 0] / norms[norms > 0]
    for least in (faint**2, 0.25):
        if not basis.shape[1]:
            return np.zeros((len(matrix), 0))
        values, vectors = np.linalg.eigh(basis.T @ basis)
        kept = values > least * values[-1]
        basis = basis @ (vectors[:, kept] / np.sqrt(values[kept]))
    return np.asarray(basis)

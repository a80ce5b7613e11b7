"""Shared by estimators: the chosen regularisation, scaled solving, and a convergence test."""

from __future__ import annotations

import numpy as np

from estimation.regressions.moments import Array, Moments


def regularisation(moments: Moments, weights: Array, gram: Array, ridge: float) -> tuple[Array, Array]:
    """Gives the quadratic and linear part of what `Moments.solve` adds to its normal equations.

    Args:
        moments: of all data; their pull counts, if they have one.
        weights: of the joints' rows (n,).
        gram: the estimator's own Gram matrix (b, b), whose diagonal a ridge without pull is a share of.
        ridge: see `Moments.solve`.

    Returns:
        R (b, b) and r (b,): solve (gram + R) pi = cross + r.
    """
    if moments.pull is None:
        return ridge * np.diag(np.diag(gram)), np.zeros(len(gram))
    precision = ridge * float(weights @ moments.square) * moments.pull.precision
    return precision, precision @ moments.pull.target


def solve_scaled(matrix: Array, right: Array) -> Array:
    """Solves matrix x = right (b, b), (b,), columns and rows brought to unit length first.

    Raises:
        numpy.linalg.LinAlgError: a singular matrix.
    """
    scale = np.sqrt(np.abs(np.diag(matrix)))
    scale = np.where(scale > 0, scale, 1.0)
    scaled = matrix / scale[:, None] / scale
    # A column that no row touches gets the value zero.
    scaled[np.diag_indices_from(scaled)] += (np.diag(matrix) == 0).astype(float)
    return np.asarray(np.linalg.solve(scaled, right / scale) / scale)


def torque_change(moments: Moments, step: Array) -> Array:
    """Gives the RMS (n,) of the torque that a step of the parameters (b,) makes on the rows that count [N m or N]."""
    quadratic = np.einsum("p,jpq,q->j", step, moments.gram, step, optimize=True)
    return np.sqrt(np.maximum(quadratic, 0.0) / np.maximum(moments.count, 1))

"""Which inertial parameters a body can have: those whose pseudo-inertia is positive definite."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.geometry.inertia import BODY_PARAMETERS

_SIGMA = ((4, (0, 0)), (5, (0, 1)), (6, (0, 2)), (7, (1, 1)), (8, (1, 2)), (9, (2, 2)))


def _basis() -> Array:
    basis = np.zeros((BODY_PARAMETERS, 4, 4))
    basis[0, 3, 3] = 1.0
    for axis in range(3):
        basis[1 + axis, axis, 3] = basis[1 + axis, 3, axis] = 1.0
    for k, (i, j) in _SIGMA:
        basis[k, i, j] = basis[k, j, i] = -1.0
        if i == j:
            # Sigma = tr(I)/2 - I: each moment of inertia counts half on every axis, less itself on its own.
            basis[k, range(3), range(3)] += 0.5
    basis.flags.writeable = False
    return basis


BASIS: Array = _basis()
"""(10, 4, 4): the pseudo-inertia is ``sum_k pi_k BASIS[k]``."""


def pseudo_inertia(parameters: ArrayLike) -> Array:
    """Builds the pseudo-inertia of bodies.

    With Sigma the second moments of mass about the frame's origin, ``Sigma = tr(I)/2 1 - I``, and h = m c, it is
    ``P = [[Sigma, h], [h', m]]``: the integral of (x, 1)(x, 1)' over the body's mass. A body of positive density has a
    positive definite P, and every such P belongs to a body (Wensing, Kim, Slotine 2018, 10.1109/LRA.2017.2729659).

    Args:
        parameters: (..., 10) ``m, mPx, mPy, mPz, Ixx, Ixy, Ixz, Iyy, Iyz, Izz`` about the frame's origin.

    Returns:
        (..., 4, 4) [kg m2, kg m, kg].

    Raises:
        InputError: another number of parameters.
    """
    values = np.asarray(parameters, dtype=np.float64)
    if values.ndim == 0 or values.shape[-1] != BODY_PARAMETERS:
        raise InputError(
            f"inertial parameters of shape {values.shape}", allowed=f"a last dimension of {BODY_PARAMETERS}"
        )
    return np.asarray(np.tensordot(values, BASIS, axes=1))


def inertial_from_pseudo(pseudo: ArrayLike) -> Array:
    """Inverts `pseudo_inertia`: ``I = tr(Sigma) 1 - Sigma``.

    Args:
        pseudo: (..., 4, 4) symmetric.

    Returns:
        (..., 10).
    """
    matrix = np.asarray(pseudo, dtype=np.float64)
    trace = np.trace(matrix[..., :3, :3], axis1=-2, axis2=-1)
    parameters = np.empty((*matrix.shape[:-2], BODY_PARAMETERS))
    parameters[..., 0] = matrix[..., 3, 3]
    parameters[..., 1:4] = matrix[..., :3, 3]
    for k, (i, j) in _SIGMA:
        parameters[..., k] = (trace if i == j else 0.0) - matrix[..., i, j]
    return parameters


def normalised_eigenvalues(parameters: ArrayLike) -> Array:
    """Gives the eigenvalues of each body's pseudo-inertia, without units.

    A congruence by the body's own mass and radius of gyration scales P to a unit mass and a unit trace of Sigma; it
    keeps the signs. A body with a mass that is not positive gets the eigenvalues of P as it is.

    Args:
        parameters: (..., 10), see `pseudo_inertia`.

    Returns:
        (..., 4) ascending; all positive for a physically possible body.
    """
    pseudo = pseudo_inertia(parameters)
    mass, trace = pseudo[..., 3, 3], np.trace(pseudo[..., :3, :3], axis1=-2, axis2=-1)
    proper = (mass > 0) & (trace > 0)
    scale = np.ones((*mass.shape, 4))
    scale[..., 3] = np.where(proper, 1 / np.sqrt(np.where(proper, mass, 1.0)), 1.0)
    scale[..., :3] = np.where(proper, 1 / np.sqrt(np.where(proper, trace, 1.0)), 1.0)[..., None]
    return np.asarray(np.linalg.eigvalsh(pseudo * scale[..., :, None] * scale[..., None, :]))

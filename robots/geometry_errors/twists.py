"""Small motions of frames: twists, their exponentials and adjoints, for many poses at once.

A twist is ``(v, w)``: a shift [m] and a turn [rad], both in the axes of the frame that moves, as in ``T exp(xi)``.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from robots.common.arrays import Array

SMALL = 1e-4  # rad; below it series are exact to rounding, and quotients of sines are not
TERMS = 24  # of the series of the right Jacobian: exact to rounding for turns of up to pi


def cross_matrix(vector: ArrayLike) -> Array:
    """Matrix ``[a]`` with ``[a] b = a x b``.

    Args:
        vector: (..., 3).

    Returns:
        (..., 3, 3).
    """
    a = np.asarray(vector, dtype=float)
    matrix = np.zeros((*a.shape, 3))
    matrix[..., 0, 1], matrix[..., 0, 2], matrix[..., 1, 2] = -a[..., 2], a[..., 1], -a[..., 0]
    return matrix - np.swapaxes(matrix, -1, -2)


def exponential(twist: ArrayLike) -> Array:
    """Pose that a frame reaches by a constant twist (Murray, Li and Sastry 1994, eq. 2.36).

    Args:
        twist: (..., 6) [m, rad].

    Returns:
        (..., 4, 4).
    """
    xi = np.asarray(twist, dtype=float)
    cross = cross_matrix(xi[..., 3:])
    angle = np.linalg.norm(xi[..., 3:], axis=-1)[..., None, None]
    tiny = angle < SMALL
    safe = np.where(tiny, 1.0, angle)
    first = np.where(tiny, 1.0 - angle**2 / 6.0, np.sin(safe) / safe)
    second = np.where(tiny, 0.5 - angle**2 / 24.0, 2.0 * np.sin(0.5 * safe) ** 2 / safe**2)
    third = np.where(tiny, 1.0 / 6.0 - angle**2 / 120.0, (safe - np.sin(safe)) / safe**3)
    square = cross @ cross
    pose = np.zeros((*xi.shape[:-1], 4, 4))
    pose[..., 3, 3] = 1.0
    pose[..., :3, :3] = np.eye(3) + first * cross + second * square
    pose[..., :3, 3] = ((np.eye(3) + second * cross + third * square) @ xi[..., :3, None])[..., 0]
    return pose


def rotation_vector(rotation: ArrayLike) -> Array:
    """Axis times angle of a rotation.

    Args:
        rotation: (..., 3, 3).

    Returns:
        (..., 3) [rad], at most pi long.
    """
    r = np.asarray(rotation, dtype=float)
    skew = 0.5 * np.stack([r[..., 2, 1] - r[..., 1, 2], r[..., 0, 2] - r[..., 2, 0], r[..., 1, 0] - r[..., 0, 1]], -1)
    sine = np.linalg.norm(skew, axis=-1)
    cosine = 0.5 * (np.trace(r, axis1=-2, axis2=-1) - 1.0)
    angle = np.arctan2(sine, cosine)
    scale = np.where(sine < SMALL, 1.0 + sine**2 / 6.0, angle / np.where(sine < SMALL, 1.0, sine))
    vector = scale[..., None] * skew
    # Near half a turn the skew part vanishes: the axis is in the symmetric part.
    half = (cosine < 0.0) & (sine < np.sqrt(SMALL))
    if np.any(half):
        outer = 0.5 * (r + np.swapaxes(r, -1, -2)) - cosine[..., None, None] * np.eye(3)
        column = np.argmax(np.einsum("...ii->...i", outer), axis=-1)
        axis = np.take_along_axis(outer, column[..., None, None], axis=-1)[..., 0]
        axis = axis / np.maximum(np.linalg.norm(axis, axis=-1, keepdims=True), np.finfo(float).tiny)
        sign = np.where(np.sum(axis * skew, axis=-1) < 0.0, -1.0, 1.0)
        vector = np.where(half[..., None], (sign * angle)[..., None] * axis, vector)
    return np.asarray(vector)


def inverse(pose: ArrayLike) -> Array:
    """Inverse of poses.

    Args:
        pose: (..., 4, 4).

    Returns:
        (..., 4, 4).
    """
    t = np.asarray(pose, dtype=float)
    turned = np.swapaxes(t[..., :3, :3], -1, -2)
    result = np.zeros_like(t)
    result[..., 3, 3] = 1.0
    result[..., :3, :3] = turned
    result[..., :3, 3] = -(turned @ t[..., :3, 3, None])[..., 0]
    return result


def adjoint(pose: ArrayLike) -> Array:
    """Matrix that expresses a twist of the frame b in the frame a, for the pose of b in a.

    Args:
        pose: (..., 4, 4).

    Returns:
        (..., 6, 6) ``[[R, [p] R], [0, R]]``.
    """
    t = np.asarray(pose, dtype=float)
    matrix = np.zeros((*t.shape[:-2], 6, 6))
    matrix[..., :3, :3] = matrix[..., 3:, 3:] = t[..., :3, :3]
    matrix[..., :3, 3:] = cross_matrix(t[..., :3, 3]) @ t[..., :3, :3]
    return matrix


def right_jacobian(twist: ArrayLike) -> Array:
    """Matrix J with ``exp(xi + d) = exp(xi) exp(J d)`` to first order in d: ``sum (-ad)^k / (k + 1)!``.

    Args:
        twist: (..., 6) [m, rad].

    Returns:
        (..., 6, 6).
    """
    xi = np.asarray(twist, dtype=float)
    ad = np.zeros((*xi.shape[:-1], 6, 6))
    ad[..., :3, :3] = ad[..., 3:, 3:] = cross_matrix(xi[..., 3:])
    ad[..., :3, 3:] = cross_matrix(xi[..., :3])
    total = np.zeros_like(ad) + np.eye(6)
    part = total
    largest = float(np.abs(ad).sum(axis=-1).max(initial=0.0))
    size = 1.0
    for k in range(1, TERMS):
        size *= largest / (k + 1)
        part = -(part @ ad) / (k + 1)
        total = total + part
        if size < np.finfo(float).eps:
            break
    return total


def rotation_log_jacobian(vector: ArrayLike) -> Array:
    """Matrix J with ``log(exp(a) exp(d)) = a + J d`` to first order in d, for turns a of less than half a turn.

    Args:
        vector: (..., 3) a [rad].

    Returns:
        (..., 3, 3).
    """
    a = np.asarray(vector, dtype=float)
    cross = cross_matrix(a)
    angle = np.linalg.norm(a, axis=-1)[..., None, None]
    tiny = angle < SMALL
    safe = np.where(tiny, 1.0, angle)
    factor = np.where(tiny, 1.0 / 12.0, 1.0 / safe**2 - (1.0 + np.cos(safe)) / (2.0 * safe * np.sin(safe)))
    return np.eye(3) + 0.5 * cross + factor * (cross @ cross)

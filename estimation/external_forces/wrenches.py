"""Force and moment at the tool from the external joint torque, with their covariance."""

from __future__ import annotations

import numpy as np

from robots.common.arrays import Array

# Below this share of the largest eigenvalue of the information a direction leaves the joints without torque.
UNOBSERVABLE_SHARE = 1e-8


def tool_load(residual: Array, covariance: Array, jacobian: Array) -> tuple[Array, Array]:
    """Estimates a load w at the tool of tau_ext = J' w by generalised least squares.

        w = (J S^-1 J')^-1 J S^-1 r

    Args:
        residual: external joint torque r (N, n) [N m or N].
        covariance: of it, S (N, n, n).
        jacobian: J (N, k, n): three rows for a force without moment, six for force and moment.

    Returns:
        The load (N, k) [N, N m] and its covariance (N, k, k). A direction that leaves the joints without torque is
        estimated as zero; the variance of a component that lies partly in it is infinite.
    """
    weighted = np.linalg.solve(covariance, np.swapaxes(jacobian, -1, -2))  # S^-1 J'
    information = jacobian @ weighted
    # One unit for force and moment: each component by its own information.
    scale = np.sqrt(np.maximum(np.einsum("...kk->...k", information), np.finfo(float).tiny))
    values, vectors = np.linalg.eigh(information / scale[..., :, None] / scale[..., None, :])
    known = values > UNOBSERVABLE_SHARE * values[..., -1:]
    inverse = np.where(known, 1.0 / np.where(known, values, 1.0), 0.0)
    spread = (
        (vectors * inverse[..., None, :]) @ np.swapaxes(vectors, -1, -2) / scale[..., :, None] / scale[..., None, :]
    )
    right = np.einsum("...nk,...n->...k", weighted, residual)
    load = np.einsum("...kl,...l->...k", spread, right)
    lost = (vectors**2 * ~known[..., None, :]).sum(axis=-1) > UNOBSERVABLE_SHARE
    diagonal = np.arange(spread.shape[-1])
    spread[..., diagonal, diagonal] = np.where(lost, np.inf, spread[..., diagonal, diagonal])
    return load, spread


def misfit(residual: Array, covariance: Array, jacobian: Array) -> Array:
    """Gives the squared distance (N,) of the residual (N, n) from the nearest torque J' w of a load."""
    load, _ = tool_load(residual, covariance, jacobian)
    left = residual - np.einsum("...kn,...k->...n", jacobian, load)
    return np.asarray(np.einsum("...n,...n->...", left, np.linalg.solve(covariance, left[..., None])[..., 0]))

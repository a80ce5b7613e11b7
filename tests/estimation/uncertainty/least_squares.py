"""Noise of a known colour, and the fit that its covariance is compared with."""

import numpy as np
from scipy.signal import lfilter

JOINTS, WEIGHTS = 2, np.array([1.0, 0.3])


def coloured(rows, rng, a=(0.9, 0.6), correlation=0.5):
    """Noise (N, 2) of first order, correlated across the joints."""
    innovations = rng.multivariate_normal([0, 0], [[1.0, correlation], [correlation, 1.0]], rows + 300)
    return np.column_stack([lfilter([1.0], [1.0, -a[j]], innovations[:, j])[300:] for j in range(JOINTS)])


def fit(Y, noise, mask):
    """Weighted least squares of noise alone: estimate, residual, inverse Gram matrix."""
    W = mask * WEIGHTS
    inverse = np.linalg.inv(np.einsum("njp,nj,njq->pq", Y, W, Y))
    values = inverse @ np.einsum("njp,nj->p", Y, W * noise)
    return values, (noise - Y @ values) * mask, inverse

"""What all joints share: errors of the ambient temperature, and work that no log shows."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Deviations of a joint, in standard deviations, from which it counts less, and not at all.
FAR, TOO_FAR = 2.0, 4.0
ITERATIONS = 10


def common_change(
    deviations: Array, variances: Array, sensitivities: Array, spread: Array, leave: int | None
) -> tuple[Array, Array]:
    """Estimates the unknowns that all joints share, such as an error of the ambient temperature.

    Weighted least squares with a normal prior; joints that deviate from the others by more than `FAR` standard
    deviations count less (Huber 1964), and by more than `TOO_FAR` not at all: a damaged joint must not move the others.

    Args:
        deviations: of the logs of friction (n,); NaN where unknown.
        variances: of them (n,).
        sensitivities: to the common unknowns (n, k).
        spread: prior standard deviations of the unknowns (k,); zero for none.
        leave: a joint that is left out, counted from 0; None for none.

    Returns:
        The unknowns (k,) and their covariance (k, k).
    """
    used = np.isfinite(deviations) & np.isfinite(variances) & (sensitivities != 0).any(axis=1)
    if leave is not None:
        used[leave] = False
    found, covariance = np.zeros(len(spread)), np.diag(np.square(spread))
    live = (spread > 0) & (sensitivities[used] != 0).any(axis=0)
    if not live.any():
        return found, covariance
    d, S, v = deviations[used], sensitivities[used][:, live], variances[used]
    prior = np.diag(spread[live] ** -2.0)
    values = _start(d, S, v, prior)
    inverse = np.linalg.inv(prior)
    for _ in range(ITERATIONS):
        distance = np.abs(d - S @ values) / np.sqrt(v)
        weight = np.where(distance < TOO_FAR, np.minimum(1.0, FAR / np.maximum(distance, FAR)) ** 2, 0.0) / v
        inverse = np.linalg.inv(prior + (S * weight[:, None]).T @ S)
        values = inverse @ (S.T @ (weight * d))
    found[live] = values
    covariance[np.ix_(live, live)] = inverse
    return found, covariance


def _start(d: Array, S: Array, v: Array, prior: Array) -> Array:
    """Unknowns to begin with: an iteration from zero would follow the joint that deviates most."""
    if S.shape[1] == 1:
        seen = S[:, 0] != 0
        return np.array([np.median(d[seen] / S[seen, 0])])
    # Least absolute deviations.
    values: Array = np.zeros(S.shape[1])
    for _ in range(2 * ITERATIONS):
        weight = 1.0 / (np.sqrt(v) * np.maximum(np.abs(d - S @ values), 0.1 * np.sqrt(v)))
        values = np.asarray(np.linalg.solve(prior + (S * weight[:, None]).T @ S, S.T @ (weight * d)), dtype=np.float64)
    return np.asarray(values)

"""Weights of measured numbers: a standard deviation per unit, and less weight for poses that do not fit."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from estimation.uncertainty.quantiles import robust_deviation
from robots.common.arrays import Array

HUBER = 2.0  # standard deviations of a pose's mean distance from where it loses weight
SMALLEST = {"m": 1e-9, "rad": 1e-9, "px": 1e-6}  # below it residuals are rounding, as of noise-free poses


@dataclass(frozen=True, kw_only=True, eq=False)
class Weights:
    """How much each measured number counts.

    Attributes:
        sigma: standard deviation by unit.
        pose: weight of each pose (N,), from 0 to 1.
    """

    sigma: Mapping[str, float]
    pose: Array

    def rows(self, units: tuple[str, ...]) -> Array:
        """Factor of each residual (N, r): root of the weight over the standard deviation."""
        return np.sqrt(self.pose)[:, None] / np.array([self.sigma[unit] for unit in units])


def pose_distance(residual: Array, units: tuple[str, ...], sigma: Mapping[str, float]) -> Array:
    """Root mean square of each pose's residuals in standard deviations (N,); 0 where nothing was measured."""
    scaled = residual / np.array([sigma[unit] for unit in units])
    count = np.isfinite(scaled).sum(axis=1)
    return np.asarray(np.sqrt(np.nansum(scaled**2, axis=1) / np.maximum(count, 1)))


def robust_weights(residual: Array, units: tuple[str, ...], parameters: int, used: Array) -> Weights:
    """Gives standard deviations by the median, and weights of poses by Huber (1964).

    Args:
        residual: (N, r).
        units: of the r numbers.
        parameters: number that were fitted.
        used: whether a pose counts at all (N,).
    """
    sigma = {}
    freedom = _freedom(residual[used > 0], parameters)
    for unit in dict.fromkeys(units):
        own = residual[used > 0][:, [u == unit for u in units]]
        sigma[unit] = max(float(robust_deviation(own.ravel())) * freedom, SMALLEST[unit])
    distance = pose_distance(residual, units, sigma)
    # Units with few numbers, and models that do not fit yet, make the median pose look off.
    distance = distance / max(float(np.median(distance[used > 0])), 1.0)
    return Weights(sigma=sigma, pose=used * np.minimum(1.0, HUBER / np.maximum(distance, HUBER)))


def least_squares_sigma(residual: Array, hat: Array, units: tuple[str, ...], used: Array) -> dict[str, float]:
    """Gives standard deviations by the sum of squares over the degrees of freedom that each unit has.

    Args:
        residual: (N, r).
        hat: share of each number that the fit follows (N, r), the diagonal of the hat matrix.
        units: of the r numbers.
        used: whether a pose counts (N,).
    """
    sigma = {}
    for unit in dict.fromkeys(units):
        own = np.array([u == unit for u in units])
        values, shares = residual[used > 0][:, own], hat[used > 0][:, own]
        seen = np.isfinite(values)
        free = float(np.sum((1.0 - shares)[seen]))
        sigma[unit] = max(float(np.sqrt(np.sum(values[seen] ** 2) / max(free, 1.0))), SMALLEST[unit])
    return sigma


def _freedom(residual: Array, parameters: int) -> float:
    rows = int(np.isfinite(residual).sum())
    return float(np.sqrt(rows / max(rows - parameters, 1)))

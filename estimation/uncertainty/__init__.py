"""Uncertainty: covariances that allow for correlated residuals."""

from estimation.uncertainty.autoregressive import Noise
from estimation.uncertainty.floors import fast_noise, period_noise
from estimation.uncertainty.repetitions import folded, repeated_covariance
from estimation.uncertainty.sandwich import Part, batch_factors, covariance, white_noise_covariance

__all__ = [
    "Noise",
    "Part",
    "batch_factors",
    "covariance",
    "fast_noise",
    "folded",
    "period_noise",
    "repeated_covariance",
    "white_noise_covariance",
]

"""Uncertainty: covariances that allow for correlated residuals."""

from estimation.uncertainty.autoregressive import Noise
from estimation.uncertainty.floors import fast_noise, period_noise
from estimation.uncertainty.repetitions import Place, Played, folded, repetitions, with_repetitions
from estimation.uncertainty.sandwich import Part, batch_factors, covariance, white_noise_covariance

__all__ = [
    "Noise",
    "Part",
    "Place",
    "Played",
    "batch_factors",
    "covariance",
    "fast_noise",
    "folded",
    "period_noise",
    "repetitions",
    "white_noise_covariance",
    "with_repetitions",
]

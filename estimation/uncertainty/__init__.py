"""Honest uncertainty: covariances that survive coloured residuals."""

from estimation.uncertainty.autoregressive import Noise
from estimation.uncertainty.sandwich import Part, covariance, white_noise_covariance

__all__ = ["Noise", "Part", "covariance", "white_noise_covariance"]

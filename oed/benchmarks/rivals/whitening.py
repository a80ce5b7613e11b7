"""Noise that is correlated in time, and filters that whiten it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_toeplitz

Array = NDArray[np.float64]

ORDER = 12  # of the autoregressive model


def autocorrelation(x: Array, lags: int) -> Array:
    """Estimates the autocorrelation at the lags 0 to ``lags``, which is 1 at lag 0."""
    centred = x - x.mean()
    size = 1 << (2 * len(x) - 1).bit_length()
    spectrum = np.fft.rfft(centred, size)
    found = np.fft.irfft(spectrum * spectrum.conj(), size)[: lags + 1]
    return np.asarray(found / found[0])


def whitening_filter(x: Array) -> Array:
    """Fits an autoregressive model by the Yule-Walker equations; returns the filter's coefficients (ORDER + 1,)."""
    rho = autocorrelation(x, ORDER)
    return np.concatenate([[1.0], -solve_toeplitz(rho[:-1], rho[1:])])

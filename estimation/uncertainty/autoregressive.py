"""The colour of a residual: autoregressive models, corrected for the noise that the fit has absorbed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from estimation.uncertainty.correlations import lagged_products
from robots.common.arrays import Array

HIGHEST_NOISE_ORDER = 40


@dataclass(frozen=True)
class Noise:
    """Each joint's noise as an autoregressive process, with innovations correlated across joints.

    Attributes:
        coefficients: per joint (p_j,): e_t = sum_k a_k e_(t-k) + epsilon_t.
        covariance: of the innovations (n, n) [(N m)^2].
    """

    coefficients: tuple[Array, ...]
    covariance: Array

    def whitened(self, residual: Array) -> Array:
        """Filters residuals (N, n) to their innovations."""
        return np.stack([whitened(residual[:, j], a) for j, a in enumerate(self.coefficients)], axis=1)

    def simulated(self, samples: int, rng: np.random.Generator, warm_up: int = 1500) -> Array:
        """Draws noise (N, n)."""
        root = np.linalg.cholesky(self.covariance)
        innovations = rng.standard_normal((samples + warm_up, len(root))) @ root.T
        columns = [lfilter([1.0], taps(a), innovations[:, j])[warm_up:] for j, a in enumerate(self.coefficients)]
        return np.stack(columns, axis=1)


def taps(coefficients: Array) -> Array:
    """Gives the filter (p + 1,) that turns an autoregressive process into its innovations: 1, -a_1, ..., -a_p."""
    return np.concatenate([[1.0], -coefficients])


def whitened(series: Array, coefficients: Array) -> Array:
    """Filters series (N, ...) of an autoregressive process (p,) to its innovations, from rest."""
    return np.asarray(lfilter(taps(coefficients), [1.0], series, axis=0))


def autocovariance(series: Array, counts: Array | float, lags: int = HIGHEST_NOISE_ORDER) -> Array:
    """Divides sums of products at lags 0..`lags` by numbers of rows.

    Args:
        series: (N, ...), zero where masked.
        counts: rows that are not masked (...).
        lags: the longest lag.

    Returns:
        Autocovariances (..., lags + 1).
    """
    return np.moveaxis(lagged_products(series, lags) / np.maximum(counts, 1.0), 0, -1)


def fit_noise(residual: Array, counts: Array, covariances: Sequence[Array] | Array, times: int = 1) -> Noise:
    """Fits one process per joint.

    Akaike's criterion takes the order that predicts best, and there stops short: what higher orders would add to the
    peak of the spectrum at rest hardly helps a prediction, but it is what slow regressors feel. Of noise that is half
    white and half correlated over 0.1 s the density at rest comes out a tenth too small; with twice the order it is
    within a few per cent, and scatters no more (Berk 1974: the order must outgrow what a finite one misses).

    Args:
        residual: (N, n), zero where masked.
        counts: rows that are not masked (n,).
        covariances: autocovariances (lags + 1,) of each joint to fit, the residual's own or corrected ones.
        times: each order is so many times the one that Akaike's criterion takes, as far as there are lags.

    Returns:
        The noise.
    """
    fits = [levinson(covariance, count, times) for covariance, count in zip(covariances, counts, strict=True)]
    noise = Noise(tuple(a for a, _ in fits), np.eye(len(fits)))
    innovations = noise.whitened(residual)
    covariance = innovations.T @ innovations / len(innovations)
    diagonal = np.sqrt(np.maximum(np.diag(covariance), np.finfo(float).tiny))
    # Variances from the recursion count the rows that are there; correlations come from the innovations.
    level = np.sqrt(np.array([variance for _, variance in fits]))
    correlation = covariance / diagonal[:, None] / diagonal
    correlation[np.diag_indices(len(fits))] = 1.0
    return Noise(noise.coefficients, _positive(correlation * level[:, None] * level))


def _positive(matrix: Array) -> Array:
    """Lifts eigenvalues that rounding, or joints that mirror each other, made zero."""
    values, vectors = np.linalg.eigh(matrix)
    floor = 1e-10 * max(float(values[-1]), np.finfo(float).tiny)
    return (vectors * np.maximum(values, floor)) @ vectors.T


def levinson(covariance: Array, count: float, times: int = 1) -> tuple[Array, float]:
    """Fits one process by the recursion of Levinson and Durbin, the order by N log(variance) + 2 order.

    Args:
        covariance: at lags 0 to the highest order (lags + 1,).
        count: rows N behind it.
        times: the order is so many times the one chosen, as far as there are lags.

    Returns:
        Coefficients (p,) and the variance of the innovations.
    """
    variance = max(float(covariance[0]), np.finfo(float).tiny)
    coefficients = np.zeros(0)
    found, scores = [(coefficients, variance)], [count * np.log(variance)]
    for order in range(1, len(covariance)):
        predicted = coefficients @ covariance[order - 1 : 0 : -1] if order > 1 else 0.0
        reflection = (covariance[order] - predicted) / variance
        if not abs(reflection) < 1:
            break
        coefficients = np.concatenate([coefficients - reflection * coefficients[::-1], [reflection]])
        variance *= 1 - reflection**2
        found.append((coefficients, variance))
        scores.append(count * np.log(variance) + 2 * order)
    return found[min(times * int(np.argmin(scores)), len(found) - 1)]

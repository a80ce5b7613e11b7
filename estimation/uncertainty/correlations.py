"""Correlation over time: sums of lagged products by Fourier transforms, and what follows from them."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.fft import irfft, next_fast_len, rfft

from robots.common.arrays import Array


def lagged_products(x: Array, lags: int) -> Array:
    """Sums the products x(t) x(t + L) over the rows t, at all lags L from 0 on.

    One Fourier transform gives all lags; zeros behind the series keep its ends apart.

    Args:
        x: series (N,) or (N, k) on a uniform grid; rows that do not count must be zero.
        lags: the longest lag, in rows.

    Returns:
        Sums (lags + 1,) or (lags + 1, k).

    Source: Wiener 1930; Khinchin 1934.
    """
    length = next_fast_len(len(x) + lags, real=True)
    return np.asarray(irfft(np.abs(rfft(x, length, axis=0)) ** 2, length, axis=0)[: lags + 1])


def autocorrelation(values: ArrayLike, lags: int | None = None, *, by_pairs: bool = False) -> Array:
    """Estimates the autocorrelation of a uniform series.

    Args:
        values: the series (N,); NaN where there is none.
        lags: the longest lag, in rows; None for all.
        by_pairs: divides each sum by the number of its pairs instead of by N: without bias, but not positive definite.

    Returns:
        Correlations (lags + 1,), 1 at lag 0; NaN of a constant series, and at lags without a pair.

    Source: Priestley, Spectral Analysis and Time Series, 1981, section 5.3.
    """
    series = np.asarray(values, dtype=np.float64)
    lags = len(series) - 1 if lags is None else lags
    known = np.isfinite(series)
    sums = lagged_products(np.where(known, series - (series[known].mean() if known.any() else 0.0), 0.0), lags)
    if sums[0] <= 0.0:
        return np.full(lags + 1, np.nan)
    if not by_pairs:
        return np.asarray(sums / sums[0])
    pairs = np.rint(lagged_products(known.astype(float), lags))
    return np.where(pairs > 0, sums / np.maximum(pairs, 1.0), np.nan) / (sums[0] / pairs[0])


def correlation_rows(series: Array) -> int:
    """Counts the rows (of N) until the autocorrelation falls below 1 / e; 0 of a constant series."""
    return int(np.argmax(autocorrelation(series) < 1 / np.e))


def effective_rows(series: Array) -> float:
    """Estimates the number of independent rows that hold as much as correlated ones (N,), at least 2.

    It is N / (1 + 2 sum of the autocorrelations up to their first zero crossing).

    Source: Bartlett 1946; Geyer 1992, section 3.3.
    """
    correlation = np.nan_to_num(autocorrelation(series))
    below = np.flatnonzero(correlation <= 0)
    last = int(below[0]) if len(below) else len(series)
    return max(len(series) / (1 + 2 * float(correlation[1:last].sum())), 2.0)


def squared_differences(a: Array, b: Array, shifts: NDArray[np.intp]) -> Array:
    """Averages (a(t + shift) - b(t))^2 over the rows t that both have, at many shifts.

    Args:
        a: series (N, k) on a uniform grid.
        b: series (M, k) on the same grid; a itself to compare it with its past.
        shifts: rows (S,), each above -M and below N.

    Returns:
        Means (S, k).
    """
    length = next_fast_len(len(a) + len(b), real=True)
    products = irfft(np.conj(rfft(b, length, axis=0)) * rfft(a, length, axis=0), length, axis=0)[shifts]
    first, last = np.maximum(shifts, 0), np.minimum(len(a), len(b) + shifts)
    of_a, of_b = (np.concatenate([np.zeros((1, x.shape[1])), np.cumsum(x**2, axis=0)]) for x in (a, b))
    squares = of_a[last] - of_a[first] + of_b[last - shifts] - of_b[first - shifts]
    return np.asarray((squares - 2 * products) / (last - first)[:, None])

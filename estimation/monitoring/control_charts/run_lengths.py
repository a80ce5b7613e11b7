"""Thresholds of control charts from the mean time between false alarms, for serially correlated statistics."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from scipy.integrate import quad
from scipy.optimize import brentq
from scipy.special import ndtr

# Mean overshoot of a normal random walk beyond a boundary, on both sides together (Siegmund 1985, eq. 10.17).
OVERSHOOT = 1.166
HIGHEST = 1e4


def cusum_run_length(threshold: float, allowance: float, correlation: float = 0.0) -> float:
    """Mean steps until a two-sided CUSUM of a standard normal AR(1) sequence gives a false alarm.

    Siegmund's approximation, with the variance of the steps replaced by the long-run variance
    (1 + rho) / (1 - rho):  ARL = v / (2 k^2) (exp(2 k b / v) - 1 - 2 k b / v) / 2,  b = h + 1.166.

    Args:
        threshold: h, in standard deviations.
        allowance: k, in standard deviations.
        correlation: rho between consecutive values.
    """
    variance = (1 + correlation) / (1 - correlation)
    exponent = 2 * allowance * (threshold + OVERSHOOT) / variance
    return float(variance / (2 * allowance**2) * (np.expm1(min(exponent, 600.0)) - exponent) / 2)


@lru_cache(maxsize=256)
def cusum_threshold(allowance: float, run_length: float, correlation: float = 0.0) -> float:
    """The threshold of a two-sided CUSUM with this mean time between false alarms.

    Args:
        allowance: k, in standard deviations.
        run_length: mean steps between false alarms.
        correlation: rho between consecutive values.
    """
    return float(
        brentq(lambda h: np.log(cusum_run_length(h, allowance, correlation) / run_length), -OVERSHOOT + 1e-6, HIGHEST)
    )


def ewma_run_length(threshold: float, weight: float, correlation: float = 0.0) -> float:
    """Mean steps between crossings of a two-sided threshold by an EWMA of a standard normal AR(1) sequence.

    The EWMA is an AR(2) process. The rate of crossings follows from its correlation between consecutive values,
    (a + rho) / (1 + a rho) with a = 1 - w. Crossings come in clusters, so alarms are rarer than crossings.

    Args:
        threshold: in standard deviations of the EWMA.
        weight: w of the newest value.
        correlation: rho between consecutive values.
    """
    keep = 1 - weight
    r = (keep + correlation) / (1 + keep * correlation)
    spread = np.sqrt(1 - r * r)
    rate, _ = quad(
        lambda y: np.exp(-y * y / 2) * ndtr((threshold - r * y) / spread),
        threshold,
        threshold + 12.0,
        epsabs=0,
        limit=200,
    )
    return float(1 / max(2 * rate / np.sqrt(2 * np.pi), np.finfo(float).tiny))


@lru_cache(maxsize=256)
def ewma_threshold(weight: float, run_length: float, correlation: float = 0.0) -> float:
    """The threshold of a two-sided EWMA chart, in its standard deviations, with this mean time between crossings.

    Args:
        weight: w of the newest value.
        run_length: mean steps between false alarms.
        correlation: rho between consecutive values.
    """
    return float(brentq(lambda L: np.log(ewma_run_length(L, weight, correlation) / run_length), 0.0, 30.0))

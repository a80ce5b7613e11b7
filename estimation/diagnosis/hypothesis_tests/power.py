"""Power of the tests: the size at which an effect is detected, and distinguished from another."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from scipy.optimize import brentq
from scipy.stats import ncx2, norm

from estimation.diagnosis.calibration import CLOSE_RIVAL_BIC, POWER
from estimation.uncertainty.quantiles import chi2_limit, normal_quantile
from robots.common.arrays import Array

DIRECTIONS = 32
"""Number of coefficient directions at which an effect with several columns is judged."""


@lru_cache(maxsize=1024)
def detectable_energy(degrees: int, tries: int, *, false_alarm: float = 0.01, penalty: float = 0.0) -> float:
    """Returns the energy lambda = |P e|^2 / sigma^2 at which an effect is found with probability `POWER`.

    The statistic of a test with k degrees of freedom is noncentral chi-square with parameter lambda. It must exceed the
    `false_alarm` level over all `tries` (Bonferroni) and the `penalty`.

    Args:
        degrees: k.
        tries: number of tests that share the false-alarm probability.
        false_alarm: probability that noise alone gives a finding.
        penalty: cost of the effect's parameters in the BIC, k log N.
    """
    level = max(chi2_limit(false_alarm, degrees, max(tries, 1)), penalty)
    return float(brentq(lambda energy: ncx2.sf(level, degrees, energy) - POWER, 1e-9, 10.0 * level + 100.0))


@lru_cache
def resolving_energy(margin: float = CLOSE_RIVAL_BIC) -> float:
    """Returns the energy at which the wrong cause is excluded with probability `POWER`.

    Twice the log likelihood ratio of true and wrong cause is normal, with mean lambda and variance 4 lambda. Here
    lambda is the energy that the wrong cause leaves of the true effect.

    Args:
        margin: value that twice the log likelihood ratio must exceed.
    """
    root = normal_quantile(POWER) + np.sqrt(normal_quantile(POWER) ** 2 + margin)
    return float(root**2)


def chance_to_resolve(energy: float, margin: float = CLOSE_RIVAL_BIC) -> float:
    """Returns the probability that a wrong cause is excluded.

    Args:
        energy: energy that it leaves of the true effect.
        margin: value that twice the log likelihood ratio must exceed.
    """
    return float(norm.cdf((energy - margin) / (2.0 * np.sqrt(energy)))) if energy > 0 else 0.0


def unit_mixtures(gram: Array) -> Array:
    """Returns random coefficient vectors of an effect with unit RMS torque.

    Args:
        gram: mean products of the columns as torque (k, k).

    Returns:
        (`DIRECTIONS`, k); no row if the columns are zero.
    """
    values, vectors = np.linalg.eigh(gram)
    kept = values > 1e-9 * max(float(values[-1]), 1e-300)
    if not kept.any():
        return np.zeros((0, len(gram)))
    root = vectors[:, kept] / np.sqrt(values[kept])  # c = root u has unit size for unit u
    return np.asarray(_directions(int(kept.sum())) @ root.T)


@lru_cache(maxsize=64)
def _directions(count: int) -> Array:
    directions = np.random.default_rng(0).standard_normal((DIRECTIONS, count))
    return np.asarray(directions / np.linalg.norm(directions, axis=1)[:, None])


def size_per_energy(mixtures: Array, left: Array) -> float:
    """Returns the RMS torque of an effect whose energy is one, as the median over coefficient vectors.

    Args:
        mixtures: coefficient vectors c of unit RMS torque (m, k).
        left: energy of the columns (k, k), base model and rivals projected out, for white noise of unit variance.

    Returns:
        1 / sqrt(median of c' left c); infinite if no energy is left.
    """
    if not len(mixtures):
        return np.inf
    middle = float(np.median(((mixtures @ left) * mixtures).sum(axis=1)))
    return 1.0 / np.sqrt(middle) if middle > 0 else np.inf


def residual_energy(left: Array, cross: Array, rival: Array, rival_raw: Array) -> Array:
    """Projects a rival's columns out of an effect's energy (Schur complement).

    Args:
        left: energy of the effect's columns (k, k).
        cross: their products with the rival's columns (k, m).
        rival: energy of the rival's columns (m, m).
        rival_raw: their energy before any projection (m,).

    Returns:
        (k, k).
    """
    scale = np.sqrt(np.maximum(rival_raw, 1e-300))
    values, vectors = np.linalg.eigh(rival / scale[:, None] / scale)
    kept = values > 1e-6
    onto = (cross / scale) @ vectors[:, kept] / np.sqrt(values[kept])
    return left - onto @ onto.T

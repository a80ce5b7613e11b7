"""How large an effect must be to be seen, and to be told from another: the chances of a likelihood ratio."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.stats import chi2, ncx2, norm

from estimation.diagnosis.calibration import CLOSE_RIVAL_BIC, POWER

Array = NDArray[np.float64]

DIRECTIONS = 32
"""Mixtures of its coefficients that an effect of several is judged by."""


@lru_cache(maxsize=1024)
def detectable_energy(degrees: int, tries: int, *, false_alarm: float = 0.01, penalty: float = 0.0) -> float:
    """Gives the energy lambda = |P e|^2 / sigma^2 at which an effect is found with the chance `POWER`.

    The statistic of a test with k degrees of freedom is noncentral chi-squared with lambda; it must exceed the level
    of `false_alarm` over all `tries` (Bonferroni), and the `penalty` of the selection.

    Args:
        degrees: k.
        tries: independent tests that share the false-alarm chance.
        false_alarm: the chance that noise alone has an effect named.
        penalty: what the effect's parameters cost in the selection, k log N.
    """
    level = max(float(chi2.isf(false_alarm / max(tries, 1), degrees)), penalty)
    return float(brentq(lambda energy: ncx2.sf(level, degrees, energy) - POWER, 1e-9, 10.0 * level + 100.0))


@lru_cache
def resolving_energy(margin: float = CLOSE_RIVAL_BIC) -> float:
    """Gives the energy at which the wrong cause falls out of the possible ones with the chance `POWER`.

    Twice the log-likelihood ratio of the true and the wrong cause is normal, of mean lambda and variance 4 lambda,
    lambda being what the wrong cause leaves of the true effect.
    """
    root = norm.ppf(POWER) + np.sqrt(norm.ppf(POWER) ** 2 + margin)
    return float(root**2)


def chance_to_resolve(energy: float, margin: float = CLOSE_RIVAL_BIC) -> float:
    """Gives the chance that a wrong cause, which leaves `energy` of the true effect, falls out of the possible ones."""
    return float(norm.cdf((energy - margin) / (2.0 * np.sqrt(energy)))) if energy > 0 else 0.0


def unit_mixtures(gram: Array) -> Array:
    """Gives coefficients of an effect of root mean square torque one: mixtures that are spread evenly.

    Args:
        gram: mean squares and products of the columns as torque (k, k).

    Returns:
        (`DIRECTIONS`, k); no row where the columns are no torque.
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
    """Gives the size of an effect whose energy is one: its root mean square torque, of a typical mixture of columns.

    Args:
        mixtures: coefficients c of size one (m, k).
        left: energy of the columns (k, k), base model and rivals projected out, noise white of variance one.

    Returns:
        1 / sqrt(c' left c), the median over mixtures; infinite where no energy is left.
    """
    if not len(mixtures):
        return np.inf
    middle = float(np.median(((mixtures @ left) * mixtures).sum(axis=1)))
    return 1.0 / np.sqrt(middle) if middle > 0 else np.inf


def residual_energy(left: Array, cross: Array, rival: Array, rival_raw: Array) -> Array:
    """Projects a rival's columns out of an effect's energy (Schur complement).

    Args:
        left: energy of the effect's columns (k, k).
        cross: their products with the rival's (k, m).
        rival: energy of the rival's columns (m, m).
        rival_raw: their energy before anything was projected out (m,).

    Returns:
        (k, k).
    """
    scale = np.sqrt(np.maximum(rival_raw, 1e-300))
    values, vectors = np.linalg.eigh(rival / scale[:, None] / scale)
    kept = values > 1e-6
    onto = (cross / scale) @ vectors[:, kept] / np.sqrt(values[kept])
    return left - onto @ onto.T

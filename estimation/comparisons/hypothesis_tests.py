"""Tests of whether estimates of several runs agree, and control of the family-wise false-alarm rate."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import chdtrc

from robots.common.arrays import Array

# Directions whose variance is below this share of the largest, after scaling, are rounding.
VARIANCE_ROUNDING = 1e-10


@dataclass(frozen=True)
class ChiSquareTest:
    """Result of a chi-square test.

    Attributes:
        statistic: chi-square.
        dof: degrees of freedom.
        p_value: probability of a larger statistic if the runs agree.
    """

    statistic: float
    dof: int
    p_value: float


def agreement_test(values: ArrayLike, covariances: ArrayLike) -> ChiSquareTest:
    """Tests whether k independent estimates of one vector agree (Cochran's Q with full covariances).

    Q = sum_i (x_i - m)' C_i^-1 (x_i - m), m the inverse-covariance weighted mean. For two runs that is the two-sample
    statistic d' (C_1 + C_2)^-1 d. Directions without variance are left out.

    Args:
        values: estimates (k, d).
        covariances: (k, d, d).

    Source:
        Cochran 1954; Hotelling 1931 for k = 2.
    """
    x, C = np.asarray(values, dtype=float), np.asarray(covariances, dtype=float)
    scale = np.sqrt(np.maximum(np.einsum("kii->ki", C).mean(axis=0), np.finfo(float).tiny))
    x, C = x / scale, C / scale[:, None] / scale
    variance, ways = np.linalg.eigh(C.mean(axis=0))
    ways = ways[:, variance > VARIANCE_ROUNDING * variance.max()]
    x, C = x @ ways, ways.T @ C @ ways
    x = x - x[0]  # the statistic does not depend on the origin, its rounding does
    W = np.linalg.inv(C)
    mean = np.linalg.solve(W.sum(axis=0), np.einsum("kij,kj->i", W, x))
    off = x - mean
    statistic = max(float(np.einsum("ki,kij,kj->", off, W, off)), 0.0)
    dof = (len(x) - 1) * x.shape[1]
    return ChiSquareTest(statistic, dof, float(chdtrc(dof, statistic)))


def adjust_holm(p_values: Sequence[float] | Array) -> Array:
    """Adjusts p-values (m,) by Holm's step-down method: the chance of any false alarm stays below the level.

    Holm needs no independence, and the tests here share a baseline and correlated parameters. Benjamini and Hochberg
    control the share of false alarms among all alarms instead, which is not the chance of one.

    Source:
        Holm 1979.
    """
    p = np.asarray(p_values, dtype=float)
    order = np.argsort(p, kind="stable")
    stepped = np.maximum.accumulate(p[order] * np.arange(len(p), 0, -1))
    adjusted = np.empty_like(p)
    adjusted[order] = np.minimum(stepped, 1.0)
    return adjusted

"""Quantiles of test statistics, the limits of tests that share one false-alarm rate, and intervals of counts."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import bdtr, betaincinv, chdtri, ndtri, stdtrit

from robots.common.arrays import Array

NORMAL_95 = float(ndtri(0.975))
"""Half-width of a two-sided 95 % interval of a normal variable, in standard deviations: 1.96."""
CHI2_95 = NORMAL_95**2
"""What chi-square of one degree of freedom exceeds with a probability of 5 %: 3.84."""
NORMAL_MEDIAN = float(ndtri(0.75))
"""Median of the absolute value of a standard normal variable: 0.6745. Its square is the median of chi-square."""
TAIL_95 = 0.025
"""Probability on either side of a 95 % interval."""
BAND_SHARE = 0.95
"""Share of the errors that a band is to hold."""


def normal_quantile(probability: float) -> float:
    """Gives what a standard normal variable does not exceed with this probability."""
    return float(ndtri(probability))


def normal_limit(alpha: float, tests: int = 1) -> float:
    """Gives the limit of absolute z-values, so that any of some two-sided tests exceeds it by chance with `alpha`.

    Source: Bonferroni; Dunn 1961.
    """
    return float(-ndtri(alpha / tests / 2))


def chi2_limit(alpha: float, degrees: int = 1, tests: int = 1) -> float:
    """Gives the limit of chi-square statistics, so that any of some tests exceeds it by chance with `alpha`.

    Source: Bonferroni; Dunn 1961.
    """
    return float(chdtri(degrees, alpha / tests))


def student_95(freedom: int) -> float:
    """Half-width of a two-sided 95 % interval of Student's t, in standard errors."""
    return float(stdtrit(freedom, 1.0 - TAIL_95))


def robust_deviation(values: ArrayLike, axis: int | None = 0) -> Array:
    """Estimates the standard deviation of normal values of mean zero by the median of their absolute values.

    NaN is left out.

    Source: Rousseeuw and Croux 1993.
    """
    return np.asarray(np.nanmedian(np.abs(values), axis=axis) / NORMAL_MEDIAN)


def band_of(errors: Array) -> Array:
    """Gives the half-widths (n,) that hold 95 % of each joint's known absolute errors (N, n); NaN where none is."""
    if not np.isnan(errors).any():
        return np.asarray(np.quantile(errors, BAND_SHARE, axis=0))
    known = [column[~np.isnan(column)] for column in errors.T]
    return np.array([np.quantile(column, BAND_SHARE) if len(column) else np.nan for column in known])


def share_interval(hits: int, tries: int) -> tuple[float, float]:
    """Gives the exact 95 % interval of a probability, from the number of hits.

    Source: Clopper and Pearson 1934.
    """
    lower = 0.0 if hits == 0 else float(betaincinv(hits, tries - hits + 1, TAIL_95))
    return lower, 1.0 if hits == tries else float(betaincinv(hits + 1, tries - hits, 1.0 - TAIL_95))


def count_interval(count: int) -> tuple[float, float]:
    """Gives the exact 95 % interval of the mean of a Poisson variable, from one count.

    Source: Garwood 1936.
    """
    lower = float(chdtri(2 * count, 1.0 - TAIL_95)) / 2.0 if count else 0.0
    return lower, float(chdtri(2 * count + 2, TAIL_95)) / 2.0


def median_interval(values: Sequence[float]) -> tuple[float, float] | None:
    """Gives the 95 % interval of a median by order statistics; None where there are too few of the sorted values.

    The k smallest and k largest values are left out, k the largest number with the probability that is allowed.

    Source: David and Nagaraja, Order Statistics, 2003, section 7.1.
    """
    n = len(values)
    below = int(np.count_nonzero(bdtr(np.arange(n), n, 0.5) <= TAIL_95)) if n else 0
    return (values[below - 1], values[n - below]) if below > 0 else None

"""Standard errors and gains by the delete-one-block jackknife, for residuals that are correlated in time."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student

from estimation.diagnosis.findings import Gain

Array = NDArray[np.float64]

FEWEST, MOST, BLOCK = 10, 30, 4.0  # least and largest number of blocks, length of a block in between [s]


def blocks_of(t: Array) -> list[NDArray[np.bool_]]:
    """Cuts rows into consecutive blocks of about equal size.

    Args:
        t: time [s], (M,).

    Returns:
        Per block a mask of its rows (M,).
    """
    count = int(np.clip((len(t) * float(np.median(np.diff(t)))) / BLOCK, FEWEST, MOST))
    number = np.minimum(np.arange(len(t)) * count // len(t), count - 1)
    return [number == k for k in range(count)]


def jackknife(values: Array) -> Array:
    """Computes jackknife standard errors.

    Args:
        values: estimates (B, ...), each without one of the B blocks.

    Returns:
        Standard errors (...).
    """
    return np.asarray(np.sqrt((len(values) - 1) * np.mean((values - values.mean(axis=0)) ** 2, axis=0)))


def gain_by_blocks(errors: Sequence[tuple[Array, Array]], level: Array) -> Gain:
    """Computes the decrease of the error, relative to the standard deviation of the gear deflection.

    Args:
        errors: per block the errors without and with the effect, each (M_b,) [rad or m].
        level: gear deflection (M,) [rad or m].

    Returns:
        Errors before and after, with the 95 % interval of their difference by the jackknife over blocks.
    """
    squares = np.array([[float(one @ one), float(two @ two), float(len(one))] for one, two in errors])
    rest = squares.sum(axis=0) - squares
    spread = max(float(level.std()), 1e-300)

    def shares(sums: Array) -> Array:
        return np.asarray(np.sqrt(sums[..., :2] / sums[..., 2:]) / spread)

    before, after = (float(value) for value in shares(squares.sum(axis=0)))
    falls = -np.diff(shares(rest), axis=1)[:, 0]
    reach = float(student.ppf(0.975, len(falls) - 1)) * float(jackknife(falls))
    return Gain(nrmse_before=before, nrmse_after=after, ci95=(before - after - reach, before - after + reach))


def independent_rows(residual: Array) -> float:
    """Estimates the number of independent rows that are equivalent to correlated rows.

    It is M / (1 + 2 sum of the autocorrelations up to their first zero crossing).

    Args:
        residual: residual (M,).

    Returns:
        The effective number of rows, at least 2.
    """
    series = residual - residual.mean()
    power = np.abs(np.fft.rfft(series, 2 * len(series))) ** 2
    correlation = np.fft.irfft(power)[: len(series)]
    correlation = correlation / max(correlation[0], 1e-300)
    below = np.flatnonzero(correlation <= 0)
    last = int(below[0]) if len(below) else len(series)
    return max(len(series) / (1 + 2 * float(correlation[1:last].sum())), 2.0)

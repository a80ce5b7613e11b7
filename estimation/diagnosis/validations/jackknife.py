"""Standard errors and gains by leaving out stretches of a log in turn, which count as independent."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student

from estimation.diagnosis.findings import Gain

Array = NDArray[np.float64]

FEWEST, MOST, BLOCK = 10, 30, 4.0  # [s] of a block where there may be more of them


def blocks_of(t: Array) -> list[NDArray[np.bool_]]:
    """Cuts rows (M,) into stretches of about as many rows, in the order of time."""
    count = int(np.clip((len(t) * float(np.median(np.diff(t)))) / BLOCK, FEWEST, MOST))
    number = np.minimum(np.arange(len(t)) * count // len(t), count - 1)
    return [number == k for k in range(count)]


def jackknife(values: Array) -> Array:
    """Standard errors (...) from estimates (B, ...) that leave out one block each."""
    return np.asarray(np.sqrt((len(values) - 1) * np.mean((values - values.mean(axis=0)) ** 2, axis=0)))


def gain_by_blocks(errors: Sequence[tuple[Array, Array]], level: Array) -> Gain:
    """The fall of the error, over the wind-up's standard deviation, with its interval by blocks."""
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
    """The number of independent rows that tell as much as rows (M,) that resemble their neighbours."""
    series = residual - residual.mean()
    power = np.abs(np.fft.rfft(series, 2 * len(series))) ** 2
    correlation = np.fft.irfft(power)[: len(series)]
    correlation = correlation / max(correlation[0], 1e-300)
    below = np.flatnonzero(correlation <= 0)
    last = int(below[0]) if len(below) else len(series)
    return max(len(series) / (1 + 2 * float(correlation[1:last].sum())), 2.0)

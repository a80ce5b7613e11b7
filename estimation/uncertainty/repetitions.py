"""Logs that repeat one motion: what a model misses repeats with the motion, and counts once and not once a period."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from estimation.uncertainty.sandwich import Part, covariance

Array = NDArray[np.float64]

# Fewer rows a period do not show a noise's colour.
LEAST_ROWS = 100
# Smoothing takes the ends of a log of two periods.
LEAST_PERIODS = 1.5
# Steps of time that differ by more than this share make no uniform grid.
UNEVEN = 0.5


def folded(part: Part, t: Array, period: float | None) -> Part:
    """Averages the rows of equal phase over the periods of a log.

    The score Y'We of a fit is, phase by phase, the number of periods times the mean row times the mean residual. Noise
    averages out in that mean; what the model misses does not. A covariance of the mean residual therefore holds both.

    Args:
        part: the log's rows.
        t: times (N,) [s].
        period: of the motion [s]; None for none.

    Returns:
        One period, which counts as often as the motion repeats; the same part where it does not, or not on a grid.
    """
    steps = np.diff(t)
    step = float(np.median(steps)) if len(steps) else 0.0
    if period is None or step <= 0 or float(np.ptp(steps)) > UNEVEN * step:
        return part
    rows = round(period / step)
    begins = [round(k * period / step) for k in range(int(part.rows * step / period) + 1)]
    begins = [begin for begin in begins if begin < part.rows]
    if rows < LEAST_ROWS or part.rows < LEAST_PERIODS * rows:
        return part
    counts, errors = np.zeros((rows, part.mask.shape[1])), np.zeros((rows, part.mask.shape[1]))
    for begin in begins:
        length = min(rows, part.rows - begin)
        counts[:length] += part.mask[begin : begin + length]
        errors[:length] += part.residual[begin : begin + length]

    def regressor(start: int, stop: int) -> Array:
        ends = [min(begin + stop, part.rows) for begin in begins]
        pieces = [
            part.regressor(begin + start, end) for begin, end in zip(begins, ends, strict=True) if end > begin + start
        ]
        total, seen = np.zeros((stop - start, *pieces[0].shape[1:])), np.zeros(stop - start)
        for piece in pieces:
            total[: len(piece)] += piece
            seen[: len(piece)] += 1
        return total / seen[:, None, None]

    return Part(
        rows=rows,
        regressor=regressor,
        mask=counts / len(begins),
        residual=errors / np.where(counts > 0, counts, 1.0),
        used=part.used,
        repeats=len(begins),
    )


def repeated_covariance(
    parts: Sequence[Part],
    times: Sequence[Array],
    periods: Sequence[float | None],
    weights: Array,
    inverse: Array,
    seed: int = 0,
    averaged: int = 1,
) -> Array:
    """Estimates the covariance of weighted least squares, of logs that may repeat their motion.

    It is that of `covariance`; where logs repeat, each parameter's standard error is at least that of one period.

    Args:
        parts: the logs.
        times: of their rows [s].
        periods: of their motions [s]; None where a motion does not repeat.
        weights: of the joints' rows (n,).
        inverse: of the weighted Gram matrix (p, p).
        seed: of the drawn noise.
        averaged: see `covariance`.
    """
    plain = covariance(parts, weights, inverse, seed, averaged=averaged)
    once = [folded(part, t, period) for part, t, period in zip(parts, times, periods, strict=True)]
    if all(one is part for one, part in zip(once, parts, strict=True)):
        return plain
    repeating = covariance(once, weights, inverse, seed, averaged=averaged)
    own = np.diag(plain)
    ratio = np.divide(np.diag(repeating), own, out=np.ones_like(own), where=own > 0)
    factor = np.sqrt(np.maximum(1.0, ratio))
    return plain * factor[:, None] * factor

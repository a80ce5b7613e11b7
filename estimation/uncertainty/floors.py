"""The noise floor of a torque, from the residual's fastest part or from differences between periods."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robots.common.arrays import Array


def fast_noise(residuals: Sequence[Array]) -> Array:
    """Level (n,) of white noise that explains the fastest part of residuals (N, n).

    Second differences e(k+1) - 2 e(k) + e(k-1) have six times the variance of white noise, and next to nothing of
    what a model leaves at the speed of a motion. Slow noise is not in it: the level is a bound from below.
    """
    squares, count = np.zeros(residuals[0].shape[1]), 0
    for residual in residuals:
        if len(residual) < 3:
            continue
        second = residual[2:] - 2 * residual[1:-1] + residual[:-2]
        squares += np.einsum("tj,tj->j", second, second)
        count += len(second)
    return np.asarray(np.sqrt(squares / (6 * max(count, 1))))


def period_noise(t: Array, residual: Array, period: float) -> Array | None:
    """Level (n,) of what does not repeat from period to period, of residuals (N, n).

    Residuals at the same phase are compared with their mean over the K periods; K / (K - 1) makes up for the mean.

    Args:
        t: times (N,) [s].
        residual: (N, n).
        period: [s].

    Returns:
        The level, or None with less than two whole periods.
    """
    whole = int((t[-1] - t[0]) / period + 1e-6)
    if whole < 2:
        return None
    phases = np.arange(int(len(t) * period / (t[-1] - t[0]))) / int(len(t) * period / (t[-1] - t[0])) * period
    runs = np.stack(
        [
            np.column_stack([np.interp(t[0] + k * period + phases, t, column) for column in residual.T])
            for k in range(whole)
        ]
    )
    variance = runs.var(axis=0, ddof=1).mean(axis=0)
    return np.asarray(np.sqrt(variance))

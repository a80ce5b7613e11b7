"""Bursts in a residual: short times in which it is far larger than usual, left out of the noise estimate."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d, uniform_filter1d

from estimation.diagnosis.calibration import BURST_SIGMAS, MAX_BURST_SHARE, SPIKE_SIGMAS
from estimation.uncertainty.quantiles import robust_deviation

Array = NDArray[np.float64]

WIDTHS = (0.3, 1.0)
"""Durations [s] over which a residual is averaged: as long as a push, and longer than spikes of noise."""


def find_bursts(pieces: Sequence[Array], measured: NDArray[np.bool_], step: float) -> NDArray[np.bool_]:
    """Marks rows (M, n) in bursts, joint by joint.

    A row is in a burst if a moving average over it is far larger than usual.

    Args:
        pieces: residual of each log (N, n) [N m or N], zero where it is not measured.
        measured: rows of all logs that count (M, n).
        step: time between rows [s].

    Returns:
        Flags (M, n); none for a joint whose bursts are too frequent to be exceptions.
    """
    marked = np.zeros_like(measured)
    rows_of = np.abs(np.concatenate(pieces))
    pairs = zip(rows_of.T, measured.T, strict=True)
    most = SPIKE_SIGMAS * np.array([robust_deviation(x[rows]) if rows.any() else 0.0 for x, rows in pairs])
    pieces = [np.clip(piece, -most, most) for piece in pieces]
    for width in WIDTHS:
        size = max(1, round(width / step))
        means = np.concatenate([uniform_filter1d(piece, size, axis=0, mode="constant") for piece in pieces])
        for j, (mean, counts) in enumerate(zip(np.abs(means).T, measured.T, strict=True)):
            if counts.any():
                far = mean > BURST_SIGMAS * robust_deviation(mean[counts])
                # A large average marks all rows that it covers.
                marked[:, j] |= maximum_filter1d(far.astype(np.int8), size) > 0
    marked &= measured
    seldom = marked.sum(axis=0) <= MAX_BURST_SHARE * measured.sum(axis=0)
    return np.asarray(marked & seldom)

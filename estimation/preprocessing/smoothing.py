"""Velocity and acceleration from positions, without phase lag."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.signal import butter, sosfiltfilt

from estimation.preprocessing.resampling import Resampled
from robots.signals import Motion

Array = NDArray[np.float64]

ORDER = 3


def smooth(positions: Resampled, cutoff: float) -> Motion:
    """Low-passes positions forward and backward, and differentiates them by fourth-order central differences.

    Args:
        positions: on a uniform grid.
        cutoff: frequency at which the two passes together are 3 dB down [Hz].

    Returns:
        The motion at the log's own times.
    """
    q = _low_pass(positions.q, positions.period, cutoff)
    dq, ddq = _differentiate(q, positions.period)
    t, grid = positions.original, positions.t
    if len(t) != len(grid) or not np.allclose(t, grid, rtol=0, atol=1e-6 * positions.period):
        at = np.clip(t, grid[0], grid[-1])
        q, dq, ddq = (CubicSpline(grid, signal)(at) for signal in (q, dq, ddq))
    return Motion(t=t, q=q, dq=dq, ddq=ddq)


def transient(duration: float, cutoff: float) -> float:
    """Time at each end of a log [s] at which the smoothing is not to be trusted."""
    return min(0.25 / cutoff, 0.05 * duration)


def _low_pass(x: Array, period: float, cutoff: float) -> Array:
    # Two passes square the magnitude: each one's own cut-off lies higher.
    own = cutoff / (np.sqrt(2) - 1) ** (1 / (2 * ORDER))
    nyquist = 0.5 / period
    if own >= 0.95 * nyquist:
        return x
    sections = butter(ORDER, own / nyquist, output="sos")
    # Four periods of the cut-off: by then the filter has forgotten how the padding began, to a part in 10^7.
    padding = int(min(len(x) - 1, max(3 * (2 * ORDER + 1), round(4 / (cutoff * period)))))
    return np.asarray(sosfiltfilt(sections, x, axis=0, padtype="odd", padlen=padding))


def _differentiate(x: Array, period: float) -> tuple[Array, Array]:
    first = np.gradient(x, period, axis=0, edge_order=2)
    first[2:-2] = (x[:-4] - 8 * x[1:-3] + 8 * x[3:-1] - x[4:]) / (12 * period)
    second = np.empty_like(x)
    second[1:-1] = (x[2:] - 2 * x[1:-1] + x[:-2]) / period**2
    second[2:-2] = (-x[:-4] + 16 * x[1:-3] - 30 * x[2:-2] + 16 * x[3:-1] - x[4:]) / (12 * period**2)
    second[0], second[-1] = second[1], second[-2]
    return first, second

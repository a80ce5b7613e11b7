"""Velocity and acceleration from positions, without phase lag."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.signal import butter, sosfiltfilt

from estimation.preprocessing.base import Smoother
from estimation.preprocessing.resampling import Resampled
from robots.signals import Motion

Array = NDArray[np.float64]

ORDER = 3


def smooth(positions: Resampled, by: float | Smoother) -> Motion:
    """Smooths positions and differentiates them.

    Args:
        positions: on a uniform grid.
        by: how; a number is the cut-off of `LowPass` [Hz].

    Returns:
        The motion at the log's own times.
    """
    return (by if isinstance(by, Smoother) else LowPass(by)).smooth(positions)


@dataclass(frozen=True)
class LowPass(Smoother):
    """Low-passes positions forward and backward, and differentiates them by fourth-order central differences.

    Attributes:
        cutoff: frequency at which the two passes together are 3 dB down [Hz].
    """

    cutoff: float
    name = "low-pass"

    def smooth(self, positions: Resampled) -> Motion:
        """Gives the motion at the log's own times."""
        q = low_pass(positions.q, positions.period, self.cutoff)
        dq, ddq = _differentiate(q, positions.period)
        t, grid = positions.original, positions.t
        if len(t) != len(grid) or not np.allclose(t, grid, rtol=0, atol=1e-6 * positions.period):
            at = np.clip(t, grid[0], grid[-1])
            q, dq, ddq = (CubicSpline(grid, signal)(at) for signal in (q, dq, ddq))
        return Motion(t=t, q=q, dq=dq, ddq=ddq)

    def edge(self, duration: float) -> float:
        """Time at each end [s] at which the smoothing has data on one side only."""
        return transient(duration, self.cutoff)


def transient(duration: float, cutoff: float) -> float:
    """Time at each end of a log [s] at which the smoothing is not reliable."""
    return min(0.25 / cutoff, 0.05 * duration)


def own_cutoff(cutoff: float) -> float:
    """Frequency [Hz] at which one pass of two is 3 dB down, where both together are at `cutoff`."""
    return cutoff / (np.sqrt(2) - 1) ** (1 / (2 * ORDER))


@lru_cache(maxsize=64)
def butterworth(order: int, share: float) -> Array:
    """Designs a low-pass in second-order sections, kept: short stretches are filtered faster than it is designed.

    Args:
        order: of the filter.
        share: its cut-off over the Nyquist frequency.
    """
    return np.asarray(butter(order, share, output="sos"))


def low_pass(x: Array, period: float, cutoff: float) -> Array:
    """Passes signals (N, n) on a grid forward and backward through a Butterworth filter, together 3 dB at `cutoff`."""
    own = own_cutoff(cutoff)
    nyquist = 0.5 / period
    if own >= 0.95 * nyquist:
        return x
    sections = butterworth(ORDER, own / nyquist)
    # Four periods of the cut-off: by then the filter has forgotten how the padding began, to a part in 10^7.
    padding = int(min(len(x) - 1, max(3 * (2 * ORDER + 1), round(4 / (cutoff * period)))))
    return np.asarray(sosfiltfilt(sections, x, axis=0, padtype="odd", padlen=padding))


def _differentiate(x: Array, period: float) -> tuple[Array, Array]:
    # Written out in place: of millions of rows each temporary is as large as the log.
    first = np.empty_like(x)
    inner = first[2:-2]
    np.subtract(x[3:-1], x[1:-3], out=inner)
    inner *= 8
    inner += x[:-4]
    inner -= x[4:]
    inner /= 12 * period
    ends = np.gradient(x[:5], period, axis=0, edge_order=2)[:2], np.gradient(x[-5:], period, axis=0, edge_order=2)[-2:]
    first[:2], first[-2:] = ends
    second = np.empty_like(x)
    inner = second[2:-2]
    np.add(x[1:-3], x[3:-1], out=inner)
    inner *= 16
    inner -= 30 * x[2:-2]
    inner -= x[:-4]
    inner -= x[4:]
    inner /= 12 * period**2
    second[[1, -2]] = (x[[2, -1]] - 2 * x[[1, -2]] + x[[0, -3]]) / period**2
    second[0], second[-1] = second[1], second[-2]
    return first, second

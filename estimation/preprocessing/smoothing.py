"""Velocity and acceleration from positions, without phase lag."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.signal import butter, sosfiltfilt

from estimation.preprocessing.base import Smoother
from estimation.preprocessing.resampling import Resampled
from robots.common.arrays import Array
from robots.signals import Motion

BUTTERWORTH_ORDER = 3


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
    """Low-passes positions forward and backward, and differentiates them by central differences.

    Attributes:
        cutoff: frequency at which the two passes together are 3 dB down [Hz].
    """

    cutoff: float
    name = "low-pass"

    def smooth(self, positions: Resampled) -> Motion:
        """Gives the motion at the log's own times."""
        q = low_pass(positions.q, positions.period, self.cutoff)
        dq, ddq = differentiate(q, positions.period)
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
    return cutoff / (np.sqrt(2) - 1) ** (1 / (2 * BUTTERWORTH_ORDER))


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
    sections = butterworth(BUTTERWORTH_ORDER, own / nyquist)
    # Four periods of the cut-off: by then the filter has forgotten how the padding began, to a part in 10^7.
    padding = int(min(len(x) - 1, max(3 * (2 * BUTTERWORTH_ORDER + 1), round(4 / (cutoff * period)))))
    return np.asarray(sosfiltfilt(sections, x, axis=0, padtype="odd", padlen=padding))


def differentiate(x: Array, period: float) -> tuple[Array, Array]:
    """Computes first and second derivatives (N, n) by central differences of sixth order, lower at the ends.

    Args:
        x: values (N, n) on a uniform grid.
        period: sample period of the grid [s].

    Returns:
        First and second derivative (N, n).
    """
    first, second = np.empty_like(x), np.empty_like(x)
    # Rows at each end by whose own differences the derivatives there are found.
    free = 7
    ends = (slice(None), slice(None)) if len(x) < 2 * free else (slice(free), slice(-free, None))
    for end in ends:
        first[end] = np.gradient(x[end], period, axis=0, edge_order=2)
        second[end] = np.gradient(first[end], period, axis=0, edge_order=2)
    if len(x) < 2 * free:
        return first, second
    # Written out in place: of millions of rows each temporary is as large as the log.
    pairs = ((x[4:-2], x[2:-4]), (x[5:-1], x[1:-5]), (x[6:], x[:-6]))
    inner, pair = first[3:-3], np.empty_like(x[6:])
    inner[:] = 0.0
    for (after, before), weight in zip(pairs, (45.0, -9.0, 1.0), strict=True):
        np.subtract(after, before, out=pair)
        pair *= weight / (60 * period)
        inner += pair
    inner = second[3:-3]
    np.multiply(x[3:-3], -490.0 / (180 * period**2), out=inner)
    for (after, before), weight in zip(pairs, (270.0, -27.0, 2.0), strict=True):
        np.add(after, before, out=pair)
        pair *= weight / (180 * period**2)
        inner += pair
    return first, second

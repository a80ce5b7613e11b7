"""Spectral lines, such as a vibration at one frequency, which do not belong to smooth noise."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from estimation.diagnosis.calibration import LINE_FALSE_ALARM

Array = NDArray[np.float64]

# Frequencies [Hz] on either side of a line from which the noise there is estimated, and the fewest spectral bins.
BESIDE, FEWEST = 1.0, 41


def remove_lines(power: Array, width: float, period: float | None = None) -> Array:
    """Replaces spectral lines by the level of the noise about them.

    The power of noise at one frequency is exponentially distributed about its density. A running median estimates that
    density without the lines. Errors of a model have lines at the harmonics of a periodic motion; these lines stay. The
    power stays unchanged if the log is too short to separate lines from coloured noise.

    Args:
        power: power at each frequency, from zero on (F, n).
        width: frequency step [Hz].
        period: period of the motion [s]; None if it does not repeat.

    Returns:
        The power (F, n), with lines and their leakage replaced by the noise level.
    """
    reach = int(2 * BESIDE / width) | 1
    if not FEWEST <= reach < len(power):
        return power
    waves = np.arange(len(power)) * width * (period or 0.0)
    between = np.abs(waves - np.round(waves)) > 0.5 * width * period if period else np.ones(len(power), dtype=bool)
    # One column at a time: the one-dimensional filter is about eighty times as fast.
    level = np.stack([median_filter(own, reach, mode="reflect") for own in power.T], axis=1) / np.log(2)
    result = np.array(power, dtype=float)
    for j in range(power.shape[1]):
        lines = between & (power[:, j] > np.log(len(power) / LINE_FALSE_ALARM) * level[:, j])
        for place in np.flatnonzero(lines):
            # The leakage of a line between two bins falls with the square of the distance.
            spread = int(0.5 * np.sqrt(power[place, j] / max(level[place, j], np.finfo(float).tiny)))
            near = slice(max(place - spread, 0), place + spread + 1)
            result[near, j] = np.where(between[near], level[near, j], result[near, j])
    return result

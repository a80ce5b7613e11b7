"""Lines in a spectrum that no smooth noise makes: what vibrates at one frequency is no colour of the noise."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from estimation.diagnosis.calibration import LINE_FALSE_ALARM

Array = NDArray[np.float64]

# Frequencies [Hz] beside a line that tell what the noise is there, and the fewest places that do.
BESIDE, FEWEST = 1.0, 41


def remove_lines(power: Array, width: float, period: float | None = None) -> Array:
    """Levels lines to the noise about them.

    The power of noise at one frequency is exponentially distributed about its density, and a median tells that whatever
    stands out of it. What a model lacks has lines at the harmonics of a repeated motion: those stay as they are, and so
    does all of a log that is too short to tell a line from a colour.

    Args:
        power: at each frequency, from none on (F, n).
        width: of a step of the frequency [Hz].
        period: of the motion [s]; None where it does not repeat.

    Returns:
        The power (F, n), lines and what they spread to as the noise about them.
    """
    reach = int(2 * BESIDE / width) | 1
    if not FEWEST <= reach < len(power):
        return power
    waves = np.arange(len(power)) * width * (period or 0.0)
    between = np.abs(waves - np.round(waves)) > 0.5 * width * period if period else np.ones(len(power), dtype=bool)
    # One column at a time: the filter of one dimension is some eighty times as fast.
    level = np.stack([median_filter(own, reach, mode="reflect") for own in power.T], axis=1) / np.log(2)
    result = np.array(power, dtype=float)
    for j in range(power.shape[1]):
        lines = between & (power[:, j] > np.log(len(power) / LINE_FALSE_ALARM) * level[:, j])
        for place in np.flatnonzero(lines):
            # Between two places of the spectrum a line falls off with the square of the distance to either side.
            spread = int(0.5 * np.sqrt(power[place, j] / max(level[place, j], np.finfo(float).tiny)))
            near = slice(max(place - spread, 0), place + spread + 1)
            result[near, j] = np.where(between[near], level[near, j], result[near, j])
    return result

"""Lines in a spectrum that no smooth noise makes: what vibrates at one frequency is no colour of the noise."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

Array = NDArray[np.float64]

# Chance that noise of a smooth density has any line in a spectrum.
CHANCE = 1e-3
# Frequencies [Hz] beside a line that tell what the noise is there, and the fewest places that do.
BESIDE, FEWEST = 1.0, 61


def without_lines(power: Array, width: float, period: float | None = None) -> Array:
    """Levels lines to the noise about them.

    The power of noise at one frequency is exponentially distributed about its density, and a median tells that whatever
    stands out of it. What repeats with a motion has lines at all of its harmonics, and is told by the errors of a model
    there: a line among those is one that stands out of the other harmonics.

    Args:
        power: at each frequency, from none on (F, n).
        width: of a step of the frequency [Hz].
        period: of the motion [s]; None where it does not repeat.

    Returns:
        The power (F, n), lines and what they spread to as the noise about them.
    """
    places = np.arange(len(power))
    waves = places * width * (period or 0.0)
    repeats = np.abs(waves - np.round(waves)) <= 0.5 * width * (period or 0.0)
    level, highest = np.array(power, dtype=float), np.full(len(power), np.inf)
    for own in (places[repeats], places[~repeats]) if period else (places,):
        if len(own) < FEWEST:
            continue
        reach = min(max(FEWEST, int(2 * BESIDE / width * len(own) / len(places))) | 1, len(own) // 2 * 2 - 1)
        level[own] = median_filter(level[own], (reach, 1), mode="reflect") / np.log(2)
        highest[own] = np.log(len(own) / CHANCE)
    result = np.array(power, dtype=float)
    for j in range(power.shape[1]):
        for place in np.flatnonzero(power[:, j] > highest * level[:, j]):
            # Between two places of the spectrum a line falls off with the square of the distance to either side.
            reach = int(0.5 * np.sqrt(power[place, j] / max(level[place, j], np.finfo(float).tiny)))
            near = slice(max(place - reach, 0), place + reach + 1)
            result[near, j] = level[near, j]
    return result

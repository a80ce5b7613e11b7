"""Resolution of a sensor: the step between the values of its column."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Number of values of a column from which its step is estimated.
SAMPLES = 20_000


def lattice_step(values: Array) -> float:
    """Finds the step of a quantised column, 0 if it has none.

    The smallest distance between neighbouring values is the step if nearly all distances are multiples of it.

    Args:
        values: (N,).
    """
    chosen = values[:: max(1, len(values) // SAMPLES)]
    distinct = np.unique(chosen)
    if len(distinct) < 3 or len(distinct) > 0.9 * len(chosen):
        # Nearly as many values as samples: a step, if any, is too small to be detected.
        return 0.0
    scale = max(float(np.abs(distinct).max()), 1e-300)
    distances = np.diff(distinct)
    distances = distances[distances > 1e-9 * scale]
    if len(distances) < 2:
        return 0.0
    step = float(np.quantile(distances, 0.01))
    multiples = distances / step
    near = np.abs(multiples - np.round(multiples)) < 0.05
    # The rounding of numbers in the file blurs high multiples: only low ones are used.
    low = multiples < 10.5
    if not low.any() or near[low].mean() < 0.95:
        return 0.0
    steps = low & (multiples > 0.5)
    return float(np.median(distances[steps] / np.round(multiples[steps])))

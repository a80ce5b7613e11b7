"""Time steps of a log, and the parts between its gaps."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Fewer rows than this give no derivatives.
FEWEST = 20
# A step is a gap above this many median steps and above this time [s]: the arm may have changed its motion meanwhile. A
# shorter interruption, as of a network, is interpolated without harm.
GAP_STEPS, GAP_TIME = 8.0, 0.1


@dataclass(frozen=True, eq=False)
class Timing:
    """The clock of a log with N rows.

    Attributes:
        steps: time steps (N - 1,) [s].
        period: median step [s], NaN without steps.
        gaps: indices of the steps that are gaps.
        parts: (first, stop) rows of the parts between gaps.
    """

    steps: Array
    period: float
    gaps: NDArray[np.intp]
    parts: tuple[tuple[int, int], ...]


def measure_timing(t: Array) -> Timing:
    """Measures the time steps and finds the gaps.

    Args:
        t: time (N,) [s].
    """
    steps = np.diff(t)
    if not len(steps):
        return Timing(steps, np.nan, np.empty(0, dtype=np.intp), ((0, len(t)),))
    period = float(np.median(steps))
    gaps = np.flatnonzero((steps > GAP_STEPS * period) & (steps > GAP_TIME))
    edges = np.concatenate([[0], gaps + 1, [len(t)]])
    return Timing(steps, period, gaps, tuple((int(first), int(stop)) for first, stop in pairwise(edges)))

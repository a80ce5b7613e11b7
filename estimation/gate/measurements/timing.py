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
        clock_steps: indices of the steps in which the clock was set.
        parts: (first, stop) rows of the parts between gaps, and between steps of the clock.
    """

    steps: Array
    period: float
    gaps: NDArray[np.intp]
    clock_steps: NDArray[np.intp]
    parts: tuple[tuple[int, int], ...]


def measure_timing(t: Array, set_at: Array | None = None) -> Timing:
    """Measures the time steps and finds the gaps.

    Args:
        t: time (N,) [s].
        set_at: times of the rows before which the clock was set [s].
    """
    steps, none = np.diff(t), np.empty(0, dtype=np.intp)
    if not len(steps):
        return Timing(steps, np.nan, none, none, ((0, len(t)),))
    period = float(np.median(steps))
    gaps = np.flatnonzero((steps > GAP_STEPS * period) & (steps > GAP_TIME))
    stepped = none if set_at is None else np.searchsorted(t, set_at) - 1
    stepped = stepped[(stepped >= 0) & (stepped < len(steps))]
    gaps = np.setdiff1d(gaps, stepped)
    edges = np.concatenate([[0], np.union1d(gaps, stepped) + 1, [len(t)]])
    return Timing(steps, period, gaps, stepped, tuple((int(first), int(stop)) for first, stop in pairwise(edges)))

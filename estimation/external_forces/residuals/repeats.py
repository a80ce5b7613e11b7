"""Which samples of a healthy log are new: where a motion repeats, so does the model's error."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

Array = NDArray[np.float64]

# Distance in each position and velocity, in their standard deviations, below which a motion is the same one.
NEAR = 0.2
# Time [s] after which a motion may repeat, largest number of such times in a log, and rows that stand for a longer log.
AFTER, MOST_TIMES, MOST_ROWS = 5.0, 50, 20_000
# A joint whose velocity varies less than this [rad/s or m/s] rests.
RESTING = 1e-6


def first_visits(t: Array, q: Array, dq: Array) -> NDArray[np.bool_]:
    """Marks the samples (N,) whose positions and velocities no sample of an earlier time had.

    The model's error is a function of the motion. A motion that repeats shows it again, and says nothing new about it.

    Args:
        t: times (N,) [s], on one clock.
        q: positions (N, n).
        dq: velocities (N, n).
    """
    state = np.concatenate([q, dq], axis=1)
    spread = state.std(axis=0)
    moves = np.tile(dq.std(axis=0) > RESTING, 2)
    new = np.ones(len(t), dtype=bool)
    if not moves.any():
        return new
    step = -(-len(t) // MOST_ROWS)
    points = state[::step, moves] / spread[moves]
    length = max(AFTER, float(t[-1] - t[0]) / MOST_TIMES)
    block = ((t[::step] - t[0]) // length).astype(int)
    seen = np.zeros(len(points), dtype=bool)
    for number in range(2, int(block[-1]) + 1):
        earlier, own = points[(block < number - 1) & ~seen], np.flatnonzero(block == number)
        if len(earlier) and len(own):
            distance, _ = cKDTree(earlier).query(points[own], p=np.inf, distance_upper_bound=NEAR)
            seen[own] = np.isfinite(distance)
    new &= ~np.repeat(seen, step)[: len(t)]
    return new

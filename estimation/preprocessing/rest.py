"""Rows in which a joint stands: friction may hold it with any torque up to that of breaking away."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d, minimum_filter1d

from robots.common.arrays import Array


def rows_at_rest(t: Array, q: Array, speed: Array | None = None) -> NDArray[np.bool_]:
    """Finds the rows (N, n) in which each joint stands for a while.

    A joint that stands in all of a log, but for a tremble, has no such rows: nothing else is known of it.

    Args:
        t: times (N,) [s].
        q: positions (N, n) [rad or m].
        speed: RMS speed (n,) in the whole log; None if these rows are the whole log.
    """
    found = np.zeros(q.shape, dtype=bool)
    if len(t) < 2:
        return found
    # A rest lasts this time [s] at least.
    rest_time = 0.15
    width = max(2, round(rest_time / float(np.median(np.diff(t))))) + 1
    if width > len(t):
        return found
    if speed is None:
        speed = np.sqrt(np.mean((np.diff(q[:: width - 1], axis=0) / np.diff(t[:: width - 1])[:, None]) ** 2, axis=0))
    # The window ends at each row; the rows of all windows with little travel are at rest.
    back = (width - 1) // 2
    travel = maximum_filter1d(q, width, axis=0, origin=back) - minimum_filter1d(q, width, axis=0, origin=back)
    travel[: width - 1] = np.inf
    # A joint is at rest while it travels less than 3 % of what it would at its RMS speed.
    still = travel < 0.03 * rest_time * speed
    found = maximum_filter1d(still.astype(np.int8), width, axis=0, origin=back - (width - 1)) > 0
    return found & ~found.all(axis=0)

"""Change points of stored logs by PELT (Killick et al. 2012), from the package `ruptures` where it is installed."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from estimation.monitoring.control_charts.level_filter import CORRELATION_TIME
from estimation.uncertainty.quantiles import robust_deviation
from robots.common.arrays import Array

# More points than this are averaged in groups before the search.
MOST_POINTS = 1500
FEWEST_POINTS = 12


class ChangePoint(NamedTuple):
    """A change of one joint's friction beyond what temperature explains.

    Attributes:
        joint: counted from 1.
        time: of the change [s].
        percent: size of the change [%].
    """

    joint: int
    time: float
    percent: float


def find_change_points(history: dict[str, Array]) -> tuple[ChangePoint, ...] | None:
    """Finds changes of the mean in the friction that temperature does not explain.

    The penalty is that of the BIC, 2 log N per change (its size and its place), times the long-run variance of the
    rest over its variance, because windows are correlated over `CORRELATION_TIME`.

    Args:
        history: see `History.table`.

    Returns:
        The change points; None where `ruptures` is not installed.
    """
    try:
        import ruptures
    except ImportError:
        return None
    found: list[ChangePoint] = []
    for j in range(history["rest"].shape[1]):
        known = np.isfinite(history["rest"][:, j])
        t, y = history["start"][known], history["rest"][known, j]
        group = -(-len(y) // MOST_POINTS)
        count = len(y) // max(group, 1)
        if count < FEWEST_POINTS:
            continue
        t, y = t[: count * group : group], y[: count * group].reshape(count, group).mean(axis=1)
        step = float(np.median(np.diff(t)))
        correlation = float(np.exp(-step / CORRELATION_TIME))
        # Below this noise a change has no meaning for friction.
        noise = max(_noise(y, step), 1e-6)
        penalty = 2 * np.log(count) * (1 + correlation) / (1 - correlation)
        # The linear kernel's cost is that of the mean; this search is compiled.
        search = ruptures.KernelCPD(kernel="linear", min_size=3)
        ends = search.fit((y / noise)[:, None]).predict(pen=penalty)
        edges = [0, *ends]
        means = [float(y[a:b].mean()) for a, b in pairwise(edges)]
        found += [
            ChangePoint(j + 1, float(t[edge]), float(100 * np.expm1(after - before)))
            for edge, before, after in zip(edges[1:-1], means[:-1], means[1:], strict=True)
        ]
    return tuple(sorted(found, key=lambda item: item.time))


def _noise(y: Array, step: float) -> float:
    """Standard deviation of noise with the correlation time, whatever changes of the mean lie in it.

    Differences over a distance have twice the variance, less what they have in common by the correlation; the median
    of their sizes forgets the few that lie across a change.
    """
    # Differences for the noise are taken over so many correlation times, and over a sixth of a history at most: those
    # that lie across two or three changes are then the fewer.
    distance = min(max(1, round(0.5 * CORRELATION_TIME / step)), len(y) // 6)
    differences = y[distance:] - y[:-distance]
    own = 2 * (1 - np.exp(-distance * step / CORRELATION_TIME))
    return float(robust_deviation(differences) / np.sqrt(own))

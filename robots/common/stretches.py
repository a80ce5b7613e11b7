"""Stretches of rows: those that have something in common, and pieces of a long log."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

# Short enough that what is worked out of a log's rows never stands in memory whole, and that threads share the work.
ROWS_AT_A_TIME = 2048


def chunks(rows: int, size: int = ROWS_AT_A_TIME) -> Iterator[slice]:
    """Cuts so many rows into slices."""
    for start in range(0, rows, size):
        yield slice(start, min(start + size, rows))


def spans(flags: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Lists the stretches [start, stop) of rows (N,) that are flagged."""
    return [(int(a), int(b)) for a, b in zip(*ends(flags), strict=True)]


def ends(flags: NDArray[np.bool_]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Gives where stretches of flagged rows (N,) begin and stop, as arrays: there may be many."""
    edges = np.flatnonzero(np.diff(flags.astype(np.int8), prepend=0, append=0))
    return edges[::2], edges[1::2]


def joined_spans(flags: NDArray[np.bool_], t: NDArray[np.float64], gap: float) -> list[tuple[int, int]]:
    """Lists the stretches [start, stop) of flagged rows (N,), those no longer apart than `gap` [s] in one.

    Args:
        flags: of the rows (N,).
        t: times (N,) [s].
        gap: longest time between the last flagged row of one and the first of the next [s].
    """
    runs: list[tuple[int, int]] = []
    for first, last in spans(flags):
        if runs and t[first] - t[runs[-1][1] - 1] <= gap:
            runs[-1] = (runs[-1][0], last)
        else:
            runs.append((first, last))
    return runs

"""Stretches of rows that have something in common."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def spans(flags: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Lists the stretches [start, stop) of rows (N,) that are flagged."""
    return [(int(a), int(b)) for a, b in zip(*ends(flags), strict=True)]


def ends(flags: NDArray[np.bool_]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Gives where stretches of flagged rows (N,) begin and stop, as arrays: there may be many."""
    edges = np.flatnonzero(np.diff(flags.astype(np.int8), prepend=0, append=0))
    return edges[::2], edges[1::2]

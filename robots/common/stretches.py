"""Stretches of rows that have something in common."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def spans(flags: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Lists the stretches [start, stop) of rows (N,) that are flagged."""
    edges = np.flatnonzero(np.diff(flags.astype(np.int8), prepend=0, append=0))
    return [(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]

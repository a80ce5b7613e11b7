"""Columns of a regressor that are contiguous in memory."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from robots.common.arrays import Array


def side_by_side(columns: Iterable[Array]) -> Array:
    """Puts columns (N,) side by side (N, k), each contiguous in memory: filters read one column at a time."""
    return np.stack(list(columns)).T


__all__ = ["side_by_side"]

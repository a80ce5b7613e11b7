"""Specification of stretches of rows."""

from __future__ import annotations

import numpy as np

from robots.common.stretches import spans


def test_stretches_are_listed() -> None:
    """Half-open, in order, at the ends too."""
    assert spans(np.array([1, 0, 1, 1, 0, 1], dtype=bool)) == [(0, 1), (2, 4), (5, 6)]

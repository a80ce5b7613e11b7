"""Specification of stretches of rows."""

from __future__ import annotations

import numpy as np

from robots.common.stretches import joined_spans, spans


def test_stretches_are_listed() -> None:
    """Half-open, in order, at the ends too."""
    assert spans(np.array([1, 0, 1, 1, 0, 1], dtype=bool)) == [(0, 1), (2, 4), (5, 6)]


def test_near_stretches_are_one() -> None:
    """A pause as long as the gap is within a stretch, a longer one ends it."""
    flags = np.array([1, 0, 1, 0, 0, 1, 1, 0], dtype=bool)
    t = 0.5 * np.arange(8)
    assert joined_spans(flags, t, 1.0) == [(0, 3), (5, 7)]
    assert joined_spans(flags, t, 1.5) == [(0, 7)]
    assert joined_spans(np.zeros(8, dtype=bool), t, 1.0) == []

"""Limits at each instant: functions of position, velocity and acceleration that are not linear in them."""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np

from robots.common.arrays import Array


class PointwiseLimit(ABC):
    """R functions of the state at one instant, each with a lower and an upper bound.

    Values are scaled so that one is the size of the bound: a solver and a report can treat all alike.

    Attributes:
        name: what is limited, as reports spell it.
        labels: of the R rows.
        lower: (R,), -inf where there is none.
        upper: (R,), +inf where there is none.
    """

    name: str
    labels: tuple[str, ...]
    lower: Array
    upper: Array

    @abstractmethod
    def values(self, q: Array, dq: Array, ddq: Array) -> Array:
        """Evaluates all rows on samples (M, n): (M, R)."""

    @abstractmethod
    def jacobian(self, q: Array, dq: Array, ddq: Array) -> Array:
        """Evaluates exact derivatives by q, dq and ddq, side by side: (M, R, 3 n)."""

    def excess(self, q: Array, dq: Array, ddq: Array) -> Array:
        """How far each row passes its nearer bound (M, R): 0 on it, negative within."""
        values = self.values(q, dq, ddq)
        return np.maximum(values - self.upper, self.lower - values)

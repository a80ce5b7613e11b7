"""A log column by column: what every check looks at, laid out and summed up once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robots.signals import Log

Array = NDArray[np.float64]

# Below this share of its size, or of 1e-9, a torque varies by rounding only.
ROUNDING = 1e-9


@dataclass(frozen=True, eq=False)
class Columns:
    """Positions, and torques or currents, joint by joint.

    Attributes:
        q: positions (n, N).
        signal: torques or currents (n, N); None without.
        prefix: of the signal's columns, ``tau`` or ``i``.
        lowest: positions (n,).
        highest: positions (n,).
        spread: standard deviation of the signal (n,).
        varies: whether the signal varies by more than rounding (n,).
    """

    q: Array
    signal: Array | None
    prefix: str
    lowest: Array
    highest: Array
    spread: Array
    varies: NDArray[np.bool_]

    @staticmethod
    def of(log: Log) -> Columns:
        """Lays a log out."""
        values, prefix = (log.tau, "tau") if log.tau is not None else (log.current, "i")
        # One column after the other in memory: sums along the rows of a long log would take ten times as long.
        q = np.ascontiguousarray(log.q.T)
        signal = None if values is None else np.ascontiguousarray(values.T)
        spread, varies = np.zeros(len(q)), np.zeros(len(q), dtype=bool)
        if signal is not None:
            low, high = signal.min(axis=1), signal.max(axis=1)
            spread = signal.std(axis=1)
            varies = high - low > ROUNDING * np.maximum(1.0, np.maximum(np.abs(low), np.abs(high)))
        return Columns(q, signal, prefix, q.min(axis=1), q.max(axis=1), spread, varies)

    @property
    def travel(self) -> Array:
        """Range of the positions (n,)."""
        return self.highest - self.lowest

    def extreme(self, joint: int) -> float:
        """The position farthest from zero of a joint, counted from 0."""
        low, high = float(self.lowest[joint]), float(self.highest[joint])
        return low if -low > high else high

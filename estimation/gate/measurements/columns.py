"""A log column by column, with the numbers that several checks need of each."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from estimation.gate.measurements.resolution import lattice_step
from robots.signals import Log

Array = NDArray[np.float64]

# A torque varies by rounding only if its range is below this share of its size, or below this value [N m, N or A].
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
        """Gives the columns of a log."""
        values, prefix = (log.tau, "tau") if log.tau is not None else (log.current, "i")
        # A column is contiguous in memory: sums along the rows of a long log would take ten times as long.
        q = np.ascontiguousarray(log.q.T)
        signal = None if values is None else np.ascontiguousarray(values.T)
        spread, varies = np.zeros(len(q)), np.zeros(len(q), dtype=bool)
        if signal is not None:
            low, high = signal.min(axis=1), signal.max(axis=1)
            spread = signal.std(axis=1)
            varies = high - low > ROUNDING * np.maximum(1.0, np.maximum(np.abs(low), np.abs(high)))
        return Columns(q, signal, prefix, q.min(axis=1), q.max(axis=1), spread, varies)

    @property
    def extremes(self) -> Array:
        """Lowest and highest positions (2, n)."""
        return np.array([self.lowest, self.highest])

    @property
    def travel(self) -> Array:
        """Range of the positions (n,)."""
        return self.highest - self.lowest

    @cached_property
    def position_steps(self) -> Array:
        """Resolution of the positions (n,), 0 for a column without a step."""
        return np.array([lattice_step(column) for column in self.q])

    @cached_property
    def signal_steps(self) -> Array:
        """Resolution of the torques or currents (n,), 0 for a column without a step."""
        return np.zeros(len(self.q)) if self.signal is None else np.array([lattice_step(x) for x in self.signal])

    def extreme(self, joint: int) -> float:
        """Gives the position of a joint, counted from 0, that is farthest from zero."""
        low, high = float(self.lowest[joint]), float(self.highest[joint])
        return low if -low > high else high

    def named(self) -> list[tuple[str, int, Array]]:
        """Lists all columns: prefix, joint counted from 0, values (N,)."""
        signals = () if self.signal is None else self.signal
        return [("q", j, column) for j, column in enumerate(self.q)] + [
            (self.prefix, j, column) for j, column in enumerate(signals)
        ]

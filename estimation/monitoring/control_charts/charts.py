"""Control charts of one monitored quantity: a CUSUM for sudden changes, an EWMA for slow ones."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from estimation.monitoring.control_charts.level_filter import CORRELATION_TIME
from estimation.monitoring.control_charts.run_lengths import cusum_threshold, ewma_threshold
from robots.common.records import Record

# Allowance of the CUSUM: half of a change by two standard deviations of the innovations.
ALLOWANCE = 1.0
# Memory of the EWMA [s]: several correlation times of the model error.
MEMORY = 1800.0
# Serial correlation of innovations: prior weight [windows], and steps to which it is rounded.
CORRELATION_PRIOR, CORRELATION_STEP, LARGEST_CORRELATION = 100.0, 0.05, 0.6


@dataclass
class Chart(Record):
    """Both charts of a quantity.

    Attributes:
        window: length of a window [s].
        run_length: windows between false alarms of each of the two.
        up: CUSUM of increases.
        down: CUSUM of decreases.
        level: EWMA of the deviation from the explained level.
        count: windows in the EWMA.
        last: the last standardised innovation.
        products: sum of products of consecutive innovations.
        squares: sum of their squares.
        unlogged: EWMA of the standard deviation by unlogged work.
    """

    window: float
    run_length: float
    up: float = 0.0
    down: float = 0.0
    level: float = 0.0
    count: int = 0
    last: float = 0.0
    products: float = 0.0
    squares: float = 0.0
    unlogged: float = 0.0

    @property
    def weight(self) -> float:
        """Weight of the newest window in the EWMA."""
        return min(1.0, self.window / MEMORY)

    @property
    def correlation(self) -> float:
        """Serial correlation of the innovations, never negative, rounded up."""
        found = self.products / (self.squares + CORRELATION_PRIOR)
        rounded = float(np.ceil(max(found, 0.0) / CORRELATION_STEP)) * CORRELATION_STEP
        return min(rounded, LARGEST_CORRELATION)

    @property
    def limits(self) -> tuple[float, float]:
        """Thresholds of the CUSUM and of the EWMA, each in its standard deviations."""
        slow = float(np.exp(-self.window / CORRELATION_TIME))
        return (
            cusum_threshold(ALLOWANCE, self.run_length, self.correlation),
            ewma_threshold(self.weight, self.run_length, slow),
        )

    def update(
        self, z: float, deviation: float, scatter: float, noise: float, unsure: float, unlogged: float = 0.0
    ) -> bool:
        """Takes one window into account, and says whether there is an alarm.

        Args:
            z: standardised innovation.
            deviation: measured minus explained level.
            scatter: standard deviation of the model error.
            noise: variance of the measured value.
            unsure: variance of the explained level.
            unlogged: standard deviation of what unlogged work does to the measured value.
        """
        clipped = float(np.clip(z, -3.0, 3.0))
        self.products += clipped * self.last
        self.squares += clipped * clipped
        self.last = clipped
        self.up = max(0.0, self.up + z - ALLOWANCE)
        self.down = max(0.0, self.down - z - ALLOWANCE)
        w = max(self.weight, 1.0 / (self.count + 1))
        self.level += w * (deviation - self.level)
        self.unlogged += w * (unlogged - self.unlogged)
        self.count += 1
        cusum, ewma = self.limits
        keep, slow = 1 - w, float(np.exp(-self.window / CORRELATION_TIME))
        share = w / (2 - w)
        variance = (
            scatter**2 * share * (1 + keep * slow) / (1 - keep * slow) + noise * share + unsure + self.unlogged**2
        )
        return max(self.up, self.down) > cusum or abs(self.level) > ewma * float(np.sqrt(variance))

    def reset(self) -> None:
        """Starts both charts again; the serial correlation is kept."""
        self.up = self.down = self.level = self.unlogged = 0.0
        self.count = 0

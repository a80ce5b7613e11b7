"""Short forces: a threshold for the largest residual of a window that follows the model's own error."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robots.common.records import Record

# Prior of a window's largest chi-square, of white noise in six joints and fifty blocks, and its weight in windows.
PRIOR_MEAN, PRIOR_DEVIATION, PRIOR_WINDOWS = 17.0, 6.0, 10.0
MOST_WINDOWS = 2000.0
EULER = 0.5772156649


@dataclass
class BurstChart(Record):
    """The extreme-value distribution (Gumbel) of a window's largest chi-square, learnt from healthy windows.

    Attributes:
        run_length: windows between false alarms.
        count: windows so far, the prior included.
        mean: of the largest chi-squares.
        square: sum of their squared deviations.
    """

    run_length: float
    count: float = PRIOR_WINDOWS
    mean: float = PRIOR_MEAN
    square: float = PRIOR_WINDOWS * PRIOR_DEVIATION**2

    @property
    def threshold(self) -> float:
        """The chi-square that a healthy window exceeds once in `run_length` windows."""
        deviation = float(np.sqrt(self.square / self.count))
        # Few windows say little of the spread.
        scale = deviation * (1 + 2 / self.count) * np.sqrt(6) / np.pi
        place = self.mean - EULER * scale
        return float(place - scale * np.log(-np.log1p(-1.0 / self.run_length)))

    def update(self, chi: float) -> bool:
        """Takes a window's largest chi-square into account, and says whether it is an alarm."""
        if chi > self.threshold:
            return True
        self.count = min(self.count + 1, MOST_WINDOWS)
        step = chi - self.mean
        self.mean += step / self.count
        if self.count >= MOST_WINDOWS:
            self.square *= 1 - 1 / MOST_WINDOWS
        self.square += step * (chi - self.mean)
        return False

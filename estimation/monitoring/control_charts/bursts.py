"""Short forces: a threshold for the largest residual of a window that follows the model's own error."""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np

# Prior of the log of a window's largest chi-square, and how many windows it counts as.
PRIOR_MEAN, PRIOR_DEVIATION, PRIOR_WINDOWS = 3.0, 0.4, 8.0
MOST_WINDOWS = 2000.0
EULER = 0.5772156649


@dataclass
class BurstChart:
    """The extreme-value distribution (Gumbel) of the log of a window's largest chi-square, learnt from healthy windows.

    Attributes:
        run_length: windows between false alarms.
        count: windows so far, the prior included.
        mean: of the logs.
        square: sum of squared deviations of the logs.
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
        return float(np.exp(place - scale * np.log(-np.log1p(-1.0 / self.run_length))))

    def update(self, chi: float) -> bool:
        """Takes a window's largest chi-square into account, and says whether it is an alarm."""
        if chi > self.threshold:
            return True
        value = float(np.log(max(chi, 1e-3)))
        self.count = min(self.count + 1, MOST_WINDOWS)
        step = value - self.mean
        self.mean += step / self.count
        if self.count >= MOST_WINDOWS:
            self.square *= 1 - 1 / MOST_WINDOWS
        self.square += step * (value - self.mean)
        return False

    def to_dict(self) -> dict[str, float]:
        """Gives the state as plain data."""
        return asdict(self)

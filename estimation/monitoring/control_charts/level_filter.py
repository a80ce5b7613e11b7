"""The healthy level of one monitored quantity: what its features explain, and a slowly varying model error."""

from __future__ import annotations

import numpy as np

from robots.common.arrays import Array
from robots.common.records import Record

# Correlation time of the model error [s], about that of a change of the motion or of the temperature.
CORRELATION_TIME = 300.0


class LevelFilter(Record):
    """A Kalman filter for y = features b + e + noise, where e is an Ornstein-Uhlenbeck process.

    The coefficients b are constant. The standard deviation of e is learnt from the innovations, from a prior on.

    Args:
        mean: prior means of the coefficients (m,).
        spread: their prior standard deviations (m,).
        scatter: prior standard deviation of e.
    """

    ENTRIES = ("state", "covariance", "scatter", "weight", "square", "time")

    state: Array
    covariance: Array
    scatter: float
    weight: float
    square: float
    time: float | None

    def __init__(self, mean: Array, spread: Array, scatter: float) -> None:
        m = len(mean)
        self.state = np.concatenate([np.asarray(mean, dtype=float), [0.0]])
        self.covariance = np.zeros((m + 1, m + 1))
        self.covariance[np.arange(m), np.arange(m)] = np.square(spread)
        self.scatter = float(scatter)
        self.covariance[m, m] = self.scatter**2
        self.weight = 0.0
        self.square = 0.0
        self.time = None

    @property
    def coefficients(self) -> Array:
        """Means of the coefficients (m,)."""
        return self.state[:-1]

    @property
    def deviation(self) -> float:
        """Standard deviation of the model error e, as learnt so far."""
        return self.scatter * float(np.sqrt(self._ratio))

    @property
    def _ratio(self) -> float:
        """The learnt variance of the model error over that of the prior."""
        # The prior of the model error's variance counts as so many windows.
        prior_windows = 30.0
        return (prior_windows + self.square) / (prior_windows + self.weight)

    def explained(self, features: Array) -> tuple[float, float]:
        """What the coefficients make of features (m,), and its variance, without the model error."""
        return float(features @ self.state[:-1]), float(features @ self.covariance[:-1, :-1] @ features)

    def predict(self, time: float) -> None:
        """Goes on to a time [s]: the model error decays, and new error comes."""
        keep = 0.0 if self.time is None else float(np.exp(-max(time - self.time, 0.0) / CORRELATION_TIME))
        self.state[-1] *= keep
        self.covariance[-1, :] *= keep
        self.covariance[:, -1] *= keep
        self.covariance[-1, -1] += self.deviation**2 * (1 - keep**2)
        self.time = time

    def widen(self, deviation: float) -> None:
        """Adds an unknown error of some standard deviation to the model error, as after a pause with unlogged work."""
        self.covariance[-1, -1] += deviation**2

    def innovation(self, features: Array, y: float, variance: float) -> tuple[float, float]:
        """Measured minus predicted value, and the variance of this difference.

        Args:
            features: (m,).
            y: the measured value.
            variance: of its noise.
        """
        row = np.concatenate([features, [1.0]])
        return y - float(row @ self.state), float(row @ self.covariance @ row) + variance

    def update(self, features: Array, y: float, variance: float) -> float:
        """Takes a measured value into account, and returns its standardised innovation."""
        error, total = self.innovation(features, y, variance)
        row = np.concatenate([features, [1.0]])
        gain = self.covariance @ row / total
        self.state = self.state + gain * error
        P = self.covariance - np.outer(gain, row @ self.covariance)
        self.covariance = (P + P.T) / 2
        z = error / float(np.sqrt(total))
        # Only what the model error makes of the innovation says something of its size.
        share = max(total - variance, 0.0) / total
        # Squared standardised innovations above this count as this: an outlier is not a larger variance.
        worth = share * min(z * z, 9.0) * self._ratio
        # No more windows than this count beside the prior.
        most = 1000.0
        self.weight = min(self.weight + share, most)
        forgotten = 1 - share / most if self.weight >= most else 1.0
        self.square = self.square * forgotten + worth
        return z

    def restart(self, mean: Array, covariance: Array, step: float, variance: float) -> None:
        """Goes on after a confirmed step of the level, which is the last coefficient.

        What the filter has learnt since the step is dropped: it took a part of the step for something else.

        Args:
            mean: of the coefficients before the step (m,).
            covariance: of them (m, m).
            step: its size.
            variance: of the size.
        """
        self.state = np.concatenate([mean, [0.0]])
        self.state[-2] += step
        self.covariance = np.zeros((len(mean) + 1, len(mean) + 1))
        self.covariance[:-1, :-1] = covariance
        self.covariance[-2, -2] += variance
        self.covariance[-1, -1] = self.deviation**2

"""How large the noise of each kind of measurement is, and how it changes with the torque."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from estimation.thermal.runs.measurements import Row
from robots.common.arrays import Array


@dataclass(frozen=True, kw_only=True)
class NoiseLevels:
    """Standard deviations.

    Attributes:
        levels: by channel: friction over its cold value, times `Row.relative`; temperatures [K].
        proportional: whether the friction's noise goes with the torque.
    """

    levels: dict[str, float]
    proportional: bool = False

    def weights(self, rows: Sequence[Row], predicted: Array) -> Array:
        """Gives one over the standard deviation of each measurement (M,), in the order of the rows."""
        parts = []
        for row, seen in zip(rows, split(rows, predicted), strict=True):
            relative = row.relative
            if self.proportional and row.channel == "friction":
                relative = relative * np.maximum(np.abs(seen), 0.05)
            parts.append(1.0 / (self.levels[row.channel] * relative))
        return np.concatenate(parts)


def first_guess(rows: Sequence[Row]) -> NoiseLevels:
    """Gives levels to begin with."""
    relative = np.concatenate([row.relative for row in rows if row.channel == "friction"] or [np.ones(1)])
    levels = {row.channel: 0.2 for row in rows}
    # First guesses: degrees, and a share of the cold friction.
    levels["friction"] = 0.01 / float(np.median(relative))
    return NoiseLevels(levels=levels)


def estimate_levels(rows: Sequence[Row], predicted: Array, parameters: int) -> NoiseLevels:
    """Estimates the levels from residuals, and whether the friction's noise goes with the torque.

    Args:
        rows: the measurements.
        predicted: by the fit (M,).
        parameters: that were fitted, and have absorbed some of the noise.
    """
    guess = first_guess(rows)
    residuals: dict[str, list[Array]] = {}
    sizes: list[Array] = []
    for row, seen in zip(rows, split(rows, predicted), strict=True):
        residuals.setdefault(row.channel, []).append((row.measured - seen) / row.relative)
        if row.channel == "friction":
            sizes.append(np.maximum(np.abs(seen), 0.05))
    total = sum(len(part) for parts in residuals.values() for part in parts)
    share = np.sqrt(total / max(total - parameters, 1))
    # Residuals below this fraction of the first guess mean exact data without noise.
    exact = 1e-4
    levels = {
        channel: max(share * _rms(np.concatenate(parts)), exact * guess.levels[channel])
        for channel, parts in residuals.items()
    }
    if "friction" not in residuals:
        return NoiseLevels(levels=levels)
    plain, size = np.concatenate(residuals["friction"]), np.concatenate(sizes)
    scaled = plain / size
    gain = len(plain) * np.log(_rms(plain) / max(_rms(scaled), 1e-300)) - float(np.log(size).sum())
    # Gain of the log likelihood that noise in proportion to the torque must bring before it is believed.
    if gain > 4.0:
        levels["friction"] = max(share * _rms(scaled), exact * guess.levels["friction"])
        return NoiseLevels(levels=levels, proportional=True)
    return NoiseLevels(levels=levels)


def split(rows: Sequence[Row], values: Array) -> list[Array]:
    """Cuts an array (M, ...) at the rows' ends."""
    return np.split(values, np.cumsum([len(row.index) for row in rows])[:-1])


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))

"""What retiming returns."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robots.signals import Motion


@dataclass(frozen=True, kw_only=True, eq=False)
class Retimed:
    """A path with a new timing.

    Args:
        motion: the new motion, uniform at the controller's period, at rest at both ends.
        method: "toppra" or "ruckig".
        duration_before: duration of what was given [s]; NaN for waypoints without times.
        duration_after: duration of `motion` [s].
        usage: peak over limit by the samples of `motion`, (n,) each, of velocity, acceleration, jerk and, where a model
            was given, torque; 1 is at the limit.
        deviation: largest distance of any given point from the retimed path in any joint [rad].
        stops: number of rests between the two ends.
    """

    motion: Motion
    method: str
    duration_before: float
    duration_after: float
    usage: dict[str, NDArray[np.float64]]
    deviation: float
    stops: int

    @property
    def peak(self) -> tuple[str, int, float]:
        """The limit that is used most: its name, the joint from 1, and the fraction."""
        name = max(self.usage, key=lambda key: self.usage[key].max())
        return name, int(self.usage[name].argmax()) + 1, float(self.usage[name].max())

    def summary(self) -> str:
        """One line for people."""
        name, joint, fraction = self.peak
        return (
            f"{self.method}: {self.duration_before:.3f} s -> {self.duration_after:.3f} s, "
            f"{100 * fraction:.1f} % of the {name} limit of joint {joint}, "
            f"path kept to {self.deviation:.2g} rad, {self.stops} stops on the way"
        )

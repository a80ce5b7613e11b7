"""What retiming returns."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robots.signals import Motion

KEPT_LIMIT_USE = 1.0 + 1e-6
"""Use of a limit up to which it counts as kept: rounding."""


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
        usage_before: the same of the given timing; None for waypoints.
        deviation: largest distance of any given point from the retimed path in any joint, in `unit`.
        stops: number of rests between the two ends.
        unit: of positions.
        waypoints: whether waypoints were given, so that the timing before is that of straight moves that stop at each.
    """

    motion: Motion
    method: str
    duration_before: float
    duration_after: float
    usage: dict[str, NDArray[np.float64]]
    usage_before: dict[str, NDArray[np.float64]] | None = None
    deviation: float
    stops: int
    unit: str = "rad"
    waypoints: bool = False

    @property
    def peak(self) -> tuple[str, int, float]:
        """The limit that is used most: its name, the joint from 1, and the fraction."""
        return _peak(self.usage)

    @property
    def given_keeps_limits(self) -> bool | None:
        """Whether the given timing keeps the same limits; None for waypoints without times."""
        return None if self.usage_before is None else _peak(self.usage_before)[2] <= KEPT_LIMIT_USE

    @property
    def slower(self) -> bool:
        """Whether the new timing takes longer than the given one."""
        return bool(self.duration_after > self.duration_before + 1e-9)

    def verdict(self) -> str:
        """Says how the new timing compares with the given one; empty for waypoints without times."""
        if self.usage_before is None:
            return ""
        change = abs(self.duration_after - self.duration_before)
        if self.waypoints:
            moves = "straight moves that stop at each waypoint"
            if change <= 1e-9:
                return f"The path takes as long as {moves}."
            return f"The path takes {change:.3f} s {'more' if self.slower else 'less'} than {moves}."
        if self.slower and self.given_keeps_limits:
            return f"The new timing is {change:.3f} s slower. The given timing respects all limits: keep it."
        if self.slower:
            name, joint, fraction = _peak(self.usage_before)
            return (
                f"The new timing is {change:.3f} s slower, because the given one uses {100 * fraction:.1f} % of the "
                f"{name} limit of joint {joint}."
            )
        if change <= 1e-9:
            return "The new timing is as fast as the given one, which already uses the limits."
        return f"The new timing is {change:.3f} s faster."

    def summary(self) -> str:
        """Describes the new timing in two lines."""
        name, joint, fraction = self.peak
        before = "" if np.isnan(self.duration_before) else f"{self.duration_before:.3f} s -> "
        line = (
            f"{self.method}: {before}{self.duration_after:.3f} s, "
            f"{100 * fraction:.1f} % of the {name} limit of joint {joint}, "
            f"path deviation {self.deviation:.2g} {self.unit}, {self.stops} intermediate stops"
        )
        return f"{line}\n  {self.verdict()}" if self.verdict() else line


def _peak(usage: dict[str, NDArray[np.float64]]) -> tuple[str, int, float]:
    name = max(usage, key=lambda key: usage[key].max())
    return name, int(usage[name].argmax()) + 1, float(usage[name].max())

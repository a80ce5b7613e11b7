"""Base class of lasting changes at one time: candidate times, and the accuracy of such a time."""

from __future__ import annotations

from typing import ClassVar, Literal

from robots.terms.effect_bases.base import Effect, Place, Shape, Situation
from robots.terms.effect_bases.states import CHANGES, change_times


class Sudden(Effect):
    """Acts from a time t_c on, and did not before.

    Attributes:
        moments: times through the data that a scan tries, besides the pauses between logs.
    """

    moments: ClassVar[int] = CHANGES
    depends_on: ClassVar[Literal["state", "time"]] = "time"
    shapes: ClassVar[tuple[Shape, ...]] = (
        Shape("change_time", "s", -float("inf"), float("inf"), "linear", inexact=0.02),
    )

    def grid(self, situation: Situation, joint: Place) -> tuple[tuple[float, ...], ...]:
        """Lists times through the data, and the pauses between logs."""
        return tuple((time,) for time in change_times(situation, self.moments))

    def bounds(self, situation: Situation, joint: Place) -> tuple[tuple[float, float], ...]:
        """Keeps the change within the data."""
        return ((float(situation.t[0]), float(situation.t[-1])),)


__all__ = ["Sudden"]

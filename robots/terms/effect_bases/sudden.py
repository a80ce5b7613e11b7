"""Base class of effects that begin at one time and last."""

from __future__ import annotations

from typing import ClassVar

from robots.terms.effect_bases.base import Effect, Place, Shape, Situation
from robots.terms.effect_bases.capabilities import Persistence
from robots.terms.effect_bases.states import SCANNED_CHANGES, change_times


class Sudden(Effect):
    """An effect that acts from a time t_c on, and not before.

    Attributes:
        moments: number of times within the data in a scan; the start of each further log is added.
    """

    moments: ClassVar[int] = SCANNED_CHANGES
    persistence: ClassVar[Persistence] = Persistence.TIME
    shapes: ClassVar[tuple[Shape, ...]] = (
        Shape("change_time", "s", -float("inf"), float("inf"), "linear", inexact=0.02),
    )

    def grid(self, situation: Situation, joint: Place) -> tuple[tuple[float, ...], ...]:
        """Lists candidate times within the data, and the start of each further log."""
        return tuple((time,) for time in change_times(situation, self.moments))

    def bounds(self, situation: Situation, joint: Place) -> tuple[tuple[float, float], ...]:
        """Bounds the change time to the data."""
        return ((float(situation.t[0]), float(situation.t[-1])),)


__all__ = ["Sudden"]

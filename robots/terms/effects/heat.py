"""What effects of heat share: they build up and go with a time constant that the data must be long enough to show."""

from __future__ import annotations

from typing import ClassVar, Literal

from robots.terms.effects.base import JointEffect, Place
from robots.terms.effects.situation import Situation


class HeatEffect(JointEffect):
    """An effect of one joint whose first shape is the time constant of a heat that is kept."""

    depends_on: ClassVar[Literal["state", "time"]] = "time"

    def grid(self, situation: Situation, joint: Place) -> tuple[tuple[float, ...], ...]:
        """Lists time constants up to three times the data's duration: all slower ones look like the slowest."""
        duration = float(situation.t[-1] - situation.t[0])
        values = [value for value in self.shapes[0].grid if value <= 3.0 * duration] or self.shapes[0].grid[:1]
        others = tuple(shape.grid[0] for shape in self.shapes[1:])
        return tuple((value, *others) for value in values)

    def forms(self, situation: Situation, joint: Place) -> tuple[tuple[float, ...], ...]:
        """Lists time constants: a log that is short beside them fits each as well, but what a pause leaves differs."""
        return self.grid(situation, joint)

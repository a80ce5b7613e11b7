"""Base class of thermal effects: they rise and decay with a time constant that the data must be long enough to show."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from robots.terms.effect_bases.base import JointEffect, Place
from robots.terms.situations.situation import Situation

if TYPE_CHECKING:
    from robots.robot import Robot

Array = NDArray[np.float64]
LEAST = 1.01
"""Factor to the shortest time constant: a fit that wants a faster one does not describe heat."""


class HeatEffect(JointEffect):
    """An effect of one joint whose first shape is the time constant of a heat that is kept."""

    depends_on: ClassVar[Literal["state", "time"]] = "time"
    has_thermal_memory: ClassVar[bool] = True
    falls: ClassVar[bool] = False
    """Whether its coefficients are falls of friction, Coulomb and viscous: what warms up loses some of it.

    Where oil gets thinner slow motion may rub more (Bittencourt and Gunnarsson 2012), but not all motion does.
    """

    def is_plausible(self, robot: Robot, joint: Place, coefficients: Array, shape: tuple[float, ...] = ()) -> bool:
        """Distinguishes thermal effects from fast followers of the source, and falling from rising effects."""
        slow = not shape or shape[0] > LEAST * self.shapes[0].lower
        warmer = self.falls and rises(robot, joint, coefficients)
        return slow and not warmer and super().is_plausible(robot, joint, coefficients)

    def grid(self, situation: Situation, joint: Place) -> tuple[tuple[float, ...], ...]:
        """Lists time constants up to three times the data's duration: all slower ones look like the slowest."""
        duration = float(situation.t[-1] - situation.t[0])
        values = [value for value in self.shapes[0].grid if value <= 3.0 * duration] or self.shapes[0].grid[:1]
        others = tuple(shape.grid[0] for shape in self.shapes[1:])
        return tuple((value, *others) for value in values)

    def forms(self, situation: Situation, joint: Place) -> tuple[tuple[float, ...], ...]:
        """Lists time constants: a log that is short beside them fits each as well, but what a pause leaves differs."""
        return self.grid(situation, joint)


def rises(robot: Robot, joint: Place, coefficients: Array) -> bool:
    """Whether friction of these falls, Coulomb and viscous (2,), is higher when warm, however fast the joint goes."""
    assert joint is not None
    coulomb, viscous = (float(value) for value in coefficients)
    fastest = float(robot.limits.velocity[joint - 1])
    return coulomb < 0 and (viscous <= 0 or (np.isfinite(fastest) and coulomb + viscous * fastest < 0))

"""Base class of thermal effects, which build up and decay with a time constant."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import numpy as np

from robots.common.arrays import Array
from robots.terms.effect_bases.base import JointEffect, Place
from robots.terms.effect_bases.capabilities import Persistence
from robots.terms.situations.situation import Situation

if TYPE_CHECKING:
    from robots.robot import Robot


class HeatEffect(JointEffect):
    """An effect of one joint whose first shape parameter is the time constant of stored heat."""

    persistence: ClassVar[Persistence] = Persistence.HEAT
    falls: ClassVar[bool] = False
    """Whether its coefficients are decreases of Coulomb and viscous friction per heat.

    Thinner oil may increase friction at low speed (Bittencourt and Gunnarsson 2012), but not at all speeds.
    """

    def is_plausible(self, robot: Robot, joint: Place, coefficients: Array, shape: tuple[float, ...] = ()) -> bool:
        """Rejects time constants at the lower bound, and friction that rises with heat if `falls` is set."""
        # Factor on the shortest time constant below which a fitted one counts as at its bound: it does not describe
        # heat.
        slow = not shape or shape[0] > 1.01 * self.shapes[0].lower
        warmer = self.falls and rises(robot, joint, coefficients)
        return slow and not warmer and super().is_plausible(robot, joint, coefficients)

    def grid(self, situation: Situation, joint: Place) -> tuple[tuple[float, ...], ...]:
        """Lists time constants up to three times the data's duration; slower ones are indistinguishable."""
        duration = float(situation.t[-1] - situation.t[0])
        values = [value for value in self.shapes[0].grid if value <= 3.0 * duration] or self.shapes[0].grid[:1]
        others = tuple(shape.grid[0] for shape in self.shapes[1:])
        return tuple((value, *others) for value in values)

    def forms(self, situation: Situation, joint: Place) -> tuple[tuple[float, ...], ...]:
        """Lists the time constants of the grid.

        A short log fits several of them equally well, but they predict different cooling during a pause.
        """
        return self.grid(situation, joint)


def rises(robot: Robot, joint: Place, coefficients: Array) -> bool:
    """Returns whether these decreases of Coulomb and viscous friction (2,) mean more friction when warm at all speeds.

    Speeds up to the joint's velocity limit count.
    """
    assert joint is not None
    coulomb, viscous = (float(value) for value in coefficients)
    fastest = float(robot.limits.velocity[joint - 1])
    return coulomb < 0 and (viscous <= 0 or (np.isfinite(fastest) and coulomb + viscous * fastest < 0))

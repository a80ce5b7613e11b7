"""A spring on a joint: a balancer, a gas spring, a cable bundle."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import casadi
import numpy as np
from numpy.typing import NDArray

from robots.terms.base import force_unit, length_unit
from robots.terms.effects.base import Coefficient, Place, Situation
from robots.terms.effects.static import Instant, StaticJointEffect

if TYPE_CHECKING:
    from robots.robot import Robot

Array = NDArray[np.float64]


class Spring(StaticJointEffect):
    """tau = c1 x + c2 x^2 + c3 x^3, x the joint's position from the middle of its range.

    Any lever and any spring make a smooth function of one position; what sin(q) and cos(q) of it resemble gravity is
    the base model's, and cannot be told from it on a level base.
    """

    name: ClassVar[str] = "spring"
    title: ClassVar[str] = "a spring or cable on the joint"
    rivals: ClassVar[tuple[str, ...]] = ("base_tilt", "torque_ripple", "asymmetric_friction", "encoder_offset")
    experiments: ClassVar[tuple[str, ...]] = ("static_hold", "second_base_pose", "payload")

    def parameters(self, robot: Robot, joint: Place) -> tuple[Coefficient, ...]:
        """Describes stiffness and its two next orders."""
        assert joint is not None
        force, length = force_unit(robot, joint - 1), length_unit(robot, joint - 1)
        return (
            Coefficient("stiffness", f"{force}/{length}"),
            Coefficient("stiffness_2", f"{force}/{length}2"),
            Coefficient("stiffness_3", f"{force}/{length}3"),
        )

    def row(self, robot: Robot, joint: int, at: Instant) -> casadi.SX:
        """Builds x, x^2 and x^3."""
        # The offset and the lower orders belong together: any middle spans the same torques, this one conditions well.
        x = at.q - _middle(robot, joint)
        return casadi.horzcat(x, x**2, x**3)

    def describe(
        self,
        joint: Place,
        coefficients: Array,
        shape: tuple[float, ...] = (),
        *,
        force: str = "N m",
        length: str = "rad",
    ) -> str:
        """Says what the values mean."""
        return (
            f"A spring or cable acts on joint {joint}: {coefficients[0]:.3g} {force}/{length} at the middle of its "
            f"range, and not linear ({coefficients[1]:.3g} {force}/{length}2, {coefficients[2]:.3g} {force}/{length}3)."
        )

    def coordinate(self, situation: Situation, joint: Place, shape: tuple[float, ...] = ()) -> tuple[str, Array]:
        """Gives the position."""
        assert joint is not None
        return f"position of joint {joint} [rad]", situation.q[:, joint - 1]


def _middle(robot: Robot, joint: int) -> float:
    lower, upper = float(robot.limits.lower[joint - 1]), float(robot.limits.upper[joint - 1])
    return (lower + upper) / 2 if np.isfinite(lower + upper) else 0.0

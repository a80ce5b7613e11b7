"""A motor that gives less torque per ampere when it gives much."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import casadi
import numpy as np
from numpy.typing import NDArray

from robots.terms.effects.base import Coefficient, Place, Shape, Situation
from robots.terms.effects.states import torque_reference
from robots.terms.effects.static import Instant, StaticJointEffect

if TYPE_CHECKING:
    from robots.robot import Robot

Array = NDArray[np.float64]


class TorqueConstantSaturation(StaticJointEffect):
    """tau = c tau |tau / tau_r|^p: the logged torque, current times a constant, outgrows the true one.

    tau_r is the joint's torque limit (100 N m where it has none), so that c is the error at the limit.
    """

    name: ClassVar[str] = "torque_constant_saturation"
    title: ClassVar[str] = "a torque constant that falls at high torque (saturation)"
    shapes: ClassVar[tuple[Shape, ...]] = (Shape("exponent", "1", 1.0, 8.0, "linear", (1.0, 2.0, 4.0)),)
    rivals: ClassVar[tuple[str, ...]] = ("current_clipping", "load_dependent_friction", "torque_constant_error")
    experiments: ClassVar[tuple[str, ...]] = ("payload", "static_hold")

    def parameters(self, robot: Robot, joint: Place) -> tuple[Coefficient, ...]:
        """Describes the relative error at the torque limit."""
        return (Coefficient("error_at_limit", "1"),)

    def row(self, robot: Robot, joint: int, at: Instant) -> casadi.SX:
        """Builds tau |tau / tau_r|^p."""
        ratio = casadi.sqrt((at.torque / torque_reference(robot, joint)) ** 2 + 1e-12)
        return at.torque * ratio ** at.shape[0]

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
            f"The torque per current of joint {joint} is not constant: the logged torque is "
            f"{100 * coefficients[0]:+.3g} % off at the torque limit, by the power {shape[0]:.2g} of the torque."
        )

    def coordinate(self, situation: Situation, joint: Place, shape: tuple[float, ...] = ()) -> tuple[str, Array]:
        """Gives the base model's torque."""
        assert joint is not None
        return f"torque of joint {joint} by the base model [N m]", situation.torque[:, joint - 1]

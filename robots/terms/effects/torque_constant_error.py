"""A wrong torque constant: the logged torque of one joint has a wrong scale."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import casadi

from robots.common.arrays import Array
from robots.terms.base import force_unit
from robots.terms.effect_bases.base import Coefficient, Place, Situation
from robots.terms.effect_bases.static import Instant, StaticJointEffect

if TYPE_CHECKING:
    from robots.robot import Robot


class TorqueConstantError(StaticJointEffect):
    """tau = c tau_R, tau_R the joint's rigid-body torque, which is logged with a factor 1 + c.

    The error shows only where the parameters of one body act on several joints. The same factor on the joint's own
    friction cannot be seen.
    """

    name: ClassVar[str] = "torque_constant_error"
    title: ClassVar[str] = "wrong torque constant"
    rivals: ClassVar[tuple[str, ...]] = ("spring", "base_tilt", "encoder_offset", "torque_constant_saturation")
    experiments: ClassVar[tuple[str, ...]] = ("payload",)

    def parameters(self, robot: Robot, joint: Place) -> tuple[Coefficient, ...]:
        """Describes the relative error."""
        return (Coefficient("relative_error", "1", -0.9, 9.0),)

    def row(self, robot: Robot, joint: int, at: Instant) -> casadi.SX:
        """Builds tau_R."""
        return at.rigid

    def describe(
        self,
        joint: Place,
        coefficients: Array,
        shape: tuple[float, ...] = (),
        *,
        force: str = "N m",
        length: str = "rad",
    ) -> str:
        """Describes the values in one sentence."""
        return (
            f"The logged torque of joint {joint} is wrong by {100 * coefficients[0]:+.3g} %. Likely cause: a wrong "
            f"torque constant."
        )

    def coordinate(self, situation: Situation, joint: Place, shape: tuple[float, ...] = ()) -> tuple[str, Array]:
        """Returns the base model's torque."""
        assert joint is not None
        return (
            f"torque of joint {joint} by the base model [{force_unit(situation.robot, joint - 1)}]",
            situation.torque[:, joint - 1],
        )

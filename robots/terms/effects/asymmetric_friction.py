"""Friction that differs with the direction of motion."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import casadi

from robots.common.arrays import Array
from robots.terms.base import force_unit, length_unit
from robots.terms.effect_bases.base import Coefficient, Place, Situation
from robots.terms.effect_bases.static import Instant, StaticJointEffect

if TYPE_CHECKING:
    from robots.robot import Robot


class AsymmetricFriction(StaticJointEffect):
    """tau = a |dq| + b dq^2: viscous direction-dependent friction.

    A difference of Coulomb friction is equivalent to the torque offset, which the base model contains.
    """

    name: ClassVar[str] = "asymmetric_friction"
    title: ClassVar[str] = "direction-dependent friction"
    rivals: ClassVar[tuple[str, ...]] = ("spring", "torque_sensor_drift", "torque_constant_error", "encoder_offset")
    experiments: ClassVar[tuple[str, ...]] = ("mirrored", "sweep")

    def parameters(self, robot: Robot, joint: Place) -> tuple[Coefficient, ...]:
        """Describes half the difference between both directions, of viscous and of quadratic friction."""
        assert joint is not None
        force, length = force_unit(robot, joint - 1), length_unit(robot, joint - 1)
        return (
            Coefficient("viscous_asymmetry", f"{force} s/{length}"),
            Coefficient("quadratic_asymmetry", f"{force} s2/{length}2"),
        )

    def row(self, robot: Robot, joint: int, at: Instant) -> casadi.SX:
        """Builds |dq| and dq^2."""
        return casadi.horzcat(at.dq * at.sign, at.dq * at.dq)

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
        way = "forward" if coefficients[0] + coefficients[1] > 0 else "backward"
        return (
            f"Joint {joint} has more friction {way}. The difference from the mean of both directions is "
            f"{coefficients[0]:.3g} "
            f"{force} s/{length} times speed and {coefficients[1]:.3g} {force} s2/{length}2 times squared speed."
        )

    def coordinate(self, situation: Situation, joint: Place, shape: tuple[float, ...] = ()) -> tuple[str, Array]:
        """Returns the velocity."""
        assert joint is not None
        unit = length_unit(situation.robot, joint - 1)
        return f"velocity of joint {joint} [{unit}/s]", situation.dq[:, joint - 1]

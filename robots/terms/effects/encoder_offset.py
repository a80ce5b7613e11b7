"""An encoder with a wrong zero."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from robots.common.arrays import Array
from robots.terms.base import length_unit
from robots.terms.effect_bases.base import Coefficient, Effect, Place, Situation

if TYPE_CHECKING:
    from robots.robot import Robot


class EncoderOffset(Effect):
    """tau = (d rigid/dq_j) o: joint j is at q + o when its encoder reports q."""

    name: ClassVar[str] = "encoder_offset"
    title: ClassVar[str] = "wrong joint zero (encoder offset)"
    rivals: ClassVar[tuple[str, ...]] = ("base_tilt", "torque_constant_error", "spring", "encoder_eccentricity")
    experiments: ClassVar[tuple[str, ...]] = ("second_base_pose", "payload")

    def parameters(self, robot: Robot, joint: Place) -> tuple[Coefficient, ...]:
        """Describes the offset."""
        assert joint is not None
        return (Coefficient("offset", length_unit(robot, joint - 1), -0.5, 0.5),)

    def columns(self, situation: Situation, joint: Place, shape: tuple[float, ...] = ()) -> Array:
        """Evaluates the torque of all joints per offset of one joint (N, n, 1)."""
        assert joint is not None
        return situation.sensitivity("position")[:, :, joint - 1 : joint].copy()

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
        return f"The true position of joint {joint} is {coefficients[0]:.3g} {length} larger than its encoder value."

    def coordinate(self, situation: Situation, joint: Place, shape: tuple[float, ...] = ()) -> tuple[str, Array]:
        """Returns the position."""
        assert joint is not None
        unit = length_unit(situation.robot, joint - 1)
        return f"position of joint {joint} [{unit}]", situation.q[:, joint - 1]

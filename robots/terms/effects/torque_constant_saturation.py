"""A torque constant that falls at high torque, because the motor saturates."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import casadi
import numpy as np

from robots.common.arrays import Array
from robots.terms.base import force_unit
from robots.terms.effect_bases.base import Coefficient, Place, Shape, Situation
from robots.terms.effect_bases.capabilities import Reading
from robots.terms.effect_bases.states import torque_reference
from robots.terms.effect_bases.static import Instant, StaticJointEffect

if TYPE_CHECKING:
    from robots.robot import Robot


class TorqueConstantSaturation(StaticJointEffect):
    """tau_e = c tau |tau / tau_r|^p: the logged torque, current times a constant, exceeds the true one.

    c is the relative error at the torque tau_r, the largest one in the logs of the fit. If `at_torque` is zero, tau_r
    is the joint's torque limit, or 100 N m without a limit.
    """

    name: ClassVar[str] = "torque_constant_saturation"
    title: ClassVar[str] = "saturation of the torque constant"
    reading: ClassVar[Reading] = Reading.DISTORTS
    shapes: ClassVar[tuple[Shape, ...]] = (
        Shape("exponent", "1", 1.0, 8.0, "linear", (1.0, 2.0, 4.0)),
        Shape("at_torque", "N m", 0.0, np.inf, "linear", default=0.0),
    )
    rivals: ClassVar[tuple[str, ...]] = ("current_clipping", "load_dependent_friction", "torque_constant_error")
    experiments: ClassVar[tuple[str, ...]] = ("payload", "static_hold")

    def parameters(self, robot: Robot, joint: Place) -> tuple[Coefficient, ...]:
        """Describes the relative error at the torque tau_r."""
        # Relative error of the formula: it uses a power of the base model's torque, which contains part of the error
        # itself.
        return (Coefficient("error", "1", inexact=0.1),)

    def grid(self, situation: Situation, joint: Place) -> tuple[tuple[float, ...], ...]:
        """Lists exponents, with the largest torque of the data as tau_r."""
        assert joint is not None
        return tuple((exponent, _largest(situation, joint)) for exponent in self.shapes[0].grid)

    def bounds(self, situation: Situation, joint: Place) -> tuple[tuple[float, float], ...]:
        """Bounds the exponent, and fixes tau_r at the largest torque of the data."""
        assert joint is not None
        exponent, _ = self.shapes
        return (exponent.lower, exponent.upper), (_largest(situation, joint),) * 2

    def row(self, robot: Robot, joint: int, at: Instant) -> casadi.SX:
        """Builds tau |tau / tau_r|^p."""
        reference = casadi.if_else(at.shape[1] > 0, at.shape[1], torque_reference(robot, joint))
        ratio = casadi.sqrt((at.torque / reference) ** 2 + 1e-12)
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
        """Describes the values in one sentence."""
        exponent, torque = shape
        at = f"{torque:.3g} {force}" if torque > 0 else "the torque limit"
        return (
            f"The torque constant of joint {joint} depends on the torque: the logged torque is wrong by "
            f"{100 * coefficients[0]:+.3g} % at {at}, with the power {exponent:.2g} of the torque."
        )

    def coordinate(self, situation: Situation, joint: Place, shape: tuple[float, ...] = ()) -> tuple[str, Array]:
        """Returns the base model's torque."""
        assert joint is not None
        return (
            f"torque of joint {joint} by the base model [{force_unit(situation.robot, joint - 1)}]",
            situation.torque[:, joint - 1],
        )


def _largest(situation: Situation, joint: int) -> float:
    """Returns the largest torque of a joint in the base model."""
    return float(np.abs(situation.torque[:, joint - 1]).max(initial=0.0))

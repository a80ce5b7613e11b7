"""Stribeck friction, which rises as the joint slows down."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import casadi
import numpy as np

from robots.common.arrays import Array
from robots.terms.base import force_unit, length_unit
from robots.terms.effect_bases.base import Coefficient, Place, Shape, Situation
from robots.terms.effect_bases.states import moving_speed
from robots.terms.effect_bases.static import Instant, StaticJointEffect

if TYPE_CHECKING:
    from robots.robot import Robot


class Stribeck(StaticJointEffect):
    """tau = F exp(-(|dq| / v_s)^d) sign(dq) (Armstrong-Helouvry et al. 1994)."""

    name: ClassVar[str] = "stribeck"
    title: ClassVar[str] = "Stribeck friction"
    needs_full_rate: ClassVar[bool] = True
    shapes: ClassVar[tuple[Shape, ...]] = (
        Shape("stribeck_velocity", "rad/s", 1e-3, 2.0, "log", inexact=0.03),
        Shape("exponent", "1", 0.5, 2.5, "linear", (1.0, 2.0)),
    )
    rivals: ClassVar[tuple[str, ...]] = ("shear_thinning", "presliding_hysteresis", "load_dependent_friction")
    experiments: ClassVar[tuple[str, ...]] = ("sweep", "micro_reversals")

    def parameters(self, robot: Robot, joint: Place) -> tuple[Coefficient, ...]:
        """Describes the break-away torque above Coulomb friction."""
        assert joint is not None
        return (Coefficient("stribeck_torque", force_unit(robot, joint - 1), lower=0.0),)

    def grid(self, situation: Situation, joint: Place) -> tuple[tuple[float, ...], ...]:
        """Lists Stribeck velocities, spaced by factors of about 2, from the slowest to half the largest speed."""
        assert joint is not None
        slow, top = moving_speed(situation, joint)
        if top == 0.0:
            return ()
        lowest = max(slow, 2.0 * float(situation.velocity_scale[joint - 1]), self.shapes[0].lower, top / 500)
        count = max(2, 1 + round(np.log2(max(0.5 * top / lowest, 1.0))))
        velocities = np.geomspace(min(lowest, 0.5 * top), 0.5 * top, count)
        return tuple((float(v), exponent) for v in velocities for exponent in self.shapes[1].grid)

    def likely(
        self, situation: Situation, joint: Place, shape: tuple[float, ...], coefficients: Array
    ) -> tuple[tuple[float | None, ...], ...]:
        """Lists the two exponents of the literature: exponential (1) and Gaussian (2)."""
        return tuple((None, exponent) for exponent in self.shapes[1].grid)

    def row(self, robot: Robot, joint: int, at: Instant) -> casadi.SX:
        """Builds exp(-(|dq| / v_s)^d) sign(dq)."""
        # The power has no derivative at zero, so the velocity ratio is smoothed by a thousandth.
        ratio = casadi.sqrt((at.dq / at.shape[0]) ** 2 + 1e-6)
        return casadi.exp(-(ratio ** at.shape[1])) * at.sign

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
            f"Joint {joint} needs {coefficients[0]:.3g} {force} more than its Coulomb friction to break away. The "
            f"difference "
            f"fades above {shape[0]:.3g} {length}/s."
        )

    def coordinate(self, situation: Situation, joint: Place, shape: tuple[float, ...] = ()) -> tuple[str, Array]:
        """Returns the velocity."""
        assert joint is not None
        unit = length_unit(situation.robot, joint - 1)
        return f"velocity of joint {joint} [{unit}/s]", situation.dq[:, joint - 1]

"""Viscous friction of shear-thinning grease, which grows less than the speed."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import casadi

from robots.common.arrays import Array
from robots.terms.base import force_unit, length_unit
from robots.terms.effect_bases.base import Coefficient, Place, Shape, Situation
from robots.terms.effect_bases.static import Instant, StaticJointEffect

if TYPE_CHECKING:
    from robots.robot import Robot


class ShearThinning(StaticJointEffect):
    """tau = F |dq / v_r|^p sign(dq), v_r = 1 rad/s (Waiboer et al. 2005)."""

    name: ClassVar[str] = "shear_thinning"
    title: ClassVar[str] = "shear-thinning viscous friction"
    needs_full_rate: ClassVar[bool] = True
    rare: ClassVar[bool] = True
    shapes: ClassVar[tuple[Shape, ...]] = (Shape("power", "1", 0.2, 0.9, "linear", (0.3, 0.5, 0.7)),)
    rivals: ClassVar[tuple[str, ...]] = ("stribeck", "presliding_hysteresis")
    experiments: ClassVar[tuple[str, ...]] = ("sweep",)

    def parameters(self, robot: Robot, joint: Place) -> tuple[Coefficient, ...]:
        """Describes the friction at 1 rad/s."""
        assert joint is not None
        return (Coefficient("friction_at_one", force_unit(robot, joint - 1)),)

    def row(self, robot: Robot, joint: int, at: Instant) -> casadi.SX:
        """Builds |dq|^p sign(dq)."""
        return casadi.sqrt(at.dq**2 + 1e-10) ** at.shape[0] * at.sign

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
            f"The viscous friction of joint {joint} grows with the power {shape[0]:.2g} of the speed. Likely cause: "
            "shear-thinning grease."
        )

    def coordinate(self, situation: Situation, joint: Place, shape: tuple[float, ...] = ()) -> tuple[str, Array]:
        """Returns the velocity."""
        assert joint is not None
        unit = length_unit(situation.robot, joint - 1)
        return f"velocity of joint {joint} [{unit}/s]", situation.dq[:, joint - 1]

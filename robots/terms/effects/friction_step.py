"""A sudden, lasting change of friction, for example by damage, a lost seal or a dragging brake."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from robots.common.arrays import Array
from robots.terms.base import force_unit, length_unit
from robots.terms.columns import side_by_side
from robots.terms.effect_bases.base import Coefficient, JointEffect, Place, Situation
from robots.terms.effect_bases.sudden import Sudden

if TYPE_CHECKING:
    from robots.robot import Robot


class FrictionStep(Sudden, JointEffect):
    """tau = (a sign(dq) + b dq) from the time t_c on."""

    name: ClassVar[str] = "friction_step"
    title: ClassVar[str] = "sudden change of friction"
    rivals: ClassVar[tuple[str, ...]] = ("thermal_friction", "load_heat", "payload_change", "external_contact")
    experiments: ClassVar[tuple[str, ...]] = ("pause", "repeat")

    def parameters(self, robot: Robot, joint: Place) -> tuple[Coefficient, ...]:
        """Describes the steps of Coulomb and viscous friction."""
        assert joint is not None
        force, length = force_unit(robot, joint - 1), length_unit(robot, joint - 1)
        return Coefficient("coulomb_step", force), Coefficient("viscous_step", f"{force} s/{length}")

    def local(self, situation: Situation, joint: int, shape: tuple[float, ...] = ()) -> Array:
        """Evaluates sign(dq) and dq after the change, zero before (N, 2)."""
        after = (situation.t >= shape[0]).astype(float)
        return side_by_side([after * situation.sign[:, joint - 1], after * situation.dq[:, joint - 1]])

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
        coulomb, viscous = coefficients[:2]
        change = "changed" if coulomb * viscous < 0 else "rose" if coulomb + viscous > 0 else "fell"
        if change == "fell":
            coulomb, viscous = -coulomb, -viscous
        return (
            f"The friction of joint {joint} {change} at t = {shape[0]:.2f} s: Coulomb by {coulomb:.3g} {force}, "
            f"viscous by {viscous:.3g} {force} s/{length}."
        )

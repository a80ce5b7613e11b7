"""Friction that falls as the motor's current heats the joint."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from robots.common.arrays import Array
from robots.terms.base import force_unit, length_unit
from robots.terms.columns import side_by_side
from robots.terms.effect_bases.base import Coefficient, Place, Shape, Situation
from robots.terms.effect_bases.heat import HeatEffect
from robots.terms.effect_bases.states import relaxation

if TYPE_CHECKING:
    from robots.robot import Robot


class LoadHeat(HeatEffect):
    """tau = -x (a sign(dq) + b dq), dx/dt = tau^2 - x / T: x is stored copper heat, which also builds up at rest."""

    name: ClassVar[str] = "load_heat"
    title: ClassVar[str] = "friction reduced by motor heat"
    rare: ClassVar[bool] = True
    shapes: ClassVar[tuple[Shape, ...]] = (Shape("time_constant", "s", 5.0, 7200.0, "log", (45.0, 400.0, 3600.0)),)
    falls: ClassVar[bool] = True
    rivals: ClassVar[tuple[str, ...]] = ("thermal_friction", "friction_step", "torque_constant_heat")
    experiments: ClassVar[tuple[str, ...]] = ("static_hold", "pause")

    def parameters(self, robot: Robot, joint: Place) -> tuple[Coefficient, ...]:
        """Describes the decrease of Coulomb and viscous friction per squared torque and time."""
        assert joint is not None
        force, length = force_unit(robot, joint - 1), length_unit(robot, joint - 1)
        heat = f"(({force})2 ks)"
        return Coefficient("coulomb_fall", f"{force}/{heat}"), Coefficient("viscous_fall", f"{force} s/{length}/{heat}")

    def local(self, situation: Situation, joint: int, shape: tuple[float, ...] = ()) -> Array:
        """Evaluates -x sign(dq) and -x dq (N, 2)."""
        x = copper_heat(situation, joint, shape[0])
        return side_by_side([-x * situation.sign[:, joint - 1], -x * situation.dq[:, joint - 1]])

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
            f"The friction of joint {joint} falls as its motor current heats the joint, also at rest. The thermal time "
            f"constant is {shape[0]:.0f} s."
        )


def copper_heat(situation: Situation, joint: int, time_constant: float) -> Array:
    """Integrates a joint's squared base-model torque to stored copper heat (N,) [(N m)2 ks].

    Args:
        situation: the motion and the base model's torque (N samples).
        joint: the joint, counted from 1.
        time_constant: [s].
    """

    def integrate() -> Array:
        return relaxation(situation, situation.torque[:, joint - 1] ** 2, time_constant) / 1000.0

    known = time_constant in LoadHeat.shapes[0].grid
    return situation.cached(("copper heat", joint, time_constant), integrate) if known else integrate()

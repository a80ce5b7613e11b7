"""A torque constant that falls as the motor warms up."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from robots.common.arrays import Array
from robots.terms.base import force_unit
from robots.terms.effect_bases.base import Coefficient, Place, Shape, Situation
from robots.terms.effect_bases.heat import HeatEffect
from robots.terms.effects.load_heat import copper_heat

if TYPE_CHECKING:
    from robots.robot import Robot


class TorqueConstantHeat(HeatEffect):
    """tau_e = c x tau, dx/dt = tau^2 - x / T: the magnets weaken as copper heat x builds up."""

    name: ClassVar[str] = "torque_constant_heat"
    title: ClassVar[str] = "temperature-dependent torque constant"
    rare: ClassVar[bool] = True
    shapes: ClassVar[tuple[Shape, ...]] = (Shape("time_constant", "s", 5.0, 7200.0, "log", (45.0, 400.0, 3600.0)),)
    rivals: ClassVar[tuple[str, ...]] = ("thermal_friction", "torque_sensor_drift", "payload_change")
    experiments: ClassVar[tuple[str, ...]] = ("static_hold", "pause")

    def parameters(self, robot: Robot, joint: Place) -> tuple[Coefficient, ...]:
        """Describes the relative increase of the logged torque per squared torque and time."""
        assert joint is not None
        return (Coefficient("rise_per_heat", f"1/(({force_unit(robot, joint - 1)})2 ks)"),)

    def local(self, situation: Situation, joint: int, shape: tuple[float, ...] = ()) -> Array:
        """Evaluates x tau (N, 1)."""
        return (copper_heat(situation, joint, shape[0]) * situation.torque[:, joint - 1])[:, None]

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
        than = "less" if coefficients[0] > 0 else "more"
        return (
            f"The motor of joint {joint} gives {than} torque per ampere as it warms up, with a time constant of "
            f"{shape[0]:.0f} s."
        )

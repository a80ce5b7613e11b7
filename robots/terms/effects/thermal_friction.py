"""Friction that changes as the joint's own friction heats it."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import NDArray

from robots.terms.base import force_unit, length_unit
from robots.terms.effect_bases.base import Coefficient, Place, Shape, Situation
from robots.terms.effect_bases.heat import HeatEffect
from robots.terms.effect_bases.states import relaxation

if TYPE_CHECKING:
    from robots.robot import Robot

Array = NDArray[np.float64]


SLOWER = 12.0
"""Time constant of the housing, as a multiple of the gear's; only a log of hours would determine it."""
MIDDLE = 400.0
FADES = 5.0
"""Largest fading times the heat kept with a middling time constant: friction is as good as gone there."""


class ThermalFriction(HeatEffect):
    """tau = -f (a sign(dq) + b dq), f = (1 - exp(-k x)) / k, x = y + w z / c, dy/dt = P - y / T, dz/dt = P - z / (c T).

    x is the heat kept of the friction power P. Temperature is heat over capacity; without a sensor, capacity and the
    friction's change per degree cannot be told apart, so coefficients are per kilojoule. Two heat nodes, gear and
    housing, answer with two exponentials: the slow one, of weight w where both have settled, is little of a log, but
    most of what a pause leaves. A lubricant's viscosity falls exponentially: the first kilojoule takes more than the
    next. Where the data do not ask for them, w and k are zero.
    """

    name: ClassVar[str] = "thermal_friction"
    title: ClassVar[str] = "temperature-dependent friction"
    shapes: ClassVar[tuple[Shape, ...]] = (
        Shape("time_constant", "s", 5.0, 7200.0, "log", (15.0, 45.0, 135.0, 400.0, 1200.0, 3600.0), 0.05),
        Shape("housing_weight", "", 0.0, 5.0, "linear", (0.0,), default=0.0, beside=True),
        Shape("fading", "1/kJ", 0.0, np.inf, "linear", (0.0,), default=0.0, beside=True),
    )
    falls: ClassVar[bool] = True
    rivals: ClassVar[tuple[str, ...]] = ("friction_step", "torque_sensor_drift", "torque_constant_heat", "load_heat")
    experiments: ClassVar[tuple[str, ...]] = ("pause", "single_joint", "static_hold")

    def parameters(self, robot: Robot, joint: Place) -> tuple[Coefficient, ...]:
        """Describes the fall of Coulomb and of viscous friction per heat."""
        assert joint is not None
        force, length = force_unit(robot, joint - 1), length_unit(robot, joint - 1)
        return (
            Coefficient("coulomb_fall", f"{force}/kJ"),
            Coefficient("viscous_fall", f"{force} s/{length}/kJ"),
        )

    def local(self, situation: Situation, joint: int, shape: tuple[float, ...] = ()) -> Array:
        """Evaluates -x sign(dq) and -x dq, x in kJ."""
        x = _kept(situation, joint, shape)
        return np.column_stack([-x * situation.sign[:, joint - 1], -x * situation.dq[:, joint - 1]])

    def bounds(self, situation: Situation, joint: Place) -> tuple[tuple[float, float], ...]:
        """Lets friction fade no faster than the heat of these logs can show."""
        assert joint is not None
        time, weight, _ = super().bounds(situation, joint)
        most = float(heat(situation, joint, MIDDLE).max(initial=0.0))
        return time, weight, (0.0, FADES / most if most > 0 else 0.0)

    def forms(self, situation: Situation, joint: Place) -> tuple[tuple[float, ...], ...]:
        """Lists time constants with housings that stay cold, and that warm up as much as the gear or more."""
        return tuple((time, weight, 0.0) for time, *_ in self.grid(situation, joint) for weight in (0.0, 1.0, 3.0))

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
            f"The friction of joint {joint} falls as it warms up: {coefficients[0]:.3g} {force} Coulomb and "
            f"{coefficients[1]:.3g} {force} s/{length} viscous friction per kJ of stored friction heat. The thermal "
            f"time constant is {shape[0]:.0f} s{_more(shape)}."
        )

    def coordinate(self, situation: Situation, joint: Place, shape: tuple[float, ...] = ()) -> tuple[str, Array]:
        """Gives the heat kept."""
        assert joint is not None
        return f"friction heat kept in joint {joint} [kJ]", _kept(situation, joint, shape)


def _more(shape: tuple[float, ...]) -> str:
    _, weight, fading = shape
    slow = f", with a second part, {weight:.2g} times as large and {SLOWER:.0f} times as slow" if weight > 0 else ""
    return slow + (f"; the effect saturates with exp(-x {fading:.2g}/kJ)" if fading > 0 else "")


def _kept(situation: Situation, joint: int, shape: tuple[float, ...]) -> Array:
    time, weight, fading = shape
    x = heat(situation, joint, time)
    if weight > 0:
        x = x + weight / SLOWER * heat(situation, joint, SLOWER * time)
    return -np.expm1(-fading * x) / fading if fading > 0 else x


def heat(situation: Situation, joint: int, time_constant: float) -> Array:
    """Integrates the base model's friction power into heat kept (N,) [kJ]."""

    def integrate() -> Array:
        j = joint - 1
        # The fitted friction of a joint that hardly moves may have a wrong sign; friction never cools.
        power = np.maximum(situation.friction[:, j] * situation.dq[:, j], 0.0)
        return relaxation(situation, power, time_constant) / 1000.0

    # Grid points are used repeatedly and cached; points of a search are used once.
    known = time_constant in ThermalFriction.shapes[0].grid
    return situation.cached(("heat", joint, time_constant), integrate) if known else integrate()

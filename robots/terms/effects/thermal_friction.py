"""Friction that falls as friction heat warms the joint."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import numpy as np

from robots.common.arrays import Array
from robots.terms.base import force_unit, length_unit
from robots.terms.columns import side_by_side
from robots.terms.effect_bases.base import Coefficient, Place, Shape, Situation
from robots.terms.effect_bases.heat import HeatEffect
from robots.terms.effect_bases.states import relaxation

if TYPE_CHECKING:
    from robots.robot import Robot


HOUSING_TIME_RATIO = 12.0
"""Time constant of the housing as a multiple of the gear's. It is fixed, because only logs of hours determine it."""


class ThermalFriction(HeatEffect):
    """tau = -f (a sign(dq) + b dq), f = (1 - exp(-k x)) / k, x = y + w z / c, dy/dt = P - y / T, dz/dt = P - z / (c T).

    x is the heat stored from the friction power P. Without a thermometer, heat capacity and the change per degree
    cannot be separated, so the coefficients are per kilojoule. Gear and housing are two heat nodes, whose response is
    the sum of two exponentials. The slow one has the weight w in steady state. It is small within a log, but most of
    the heat that remains after a pause. A lubricant's viscosity falls exponentially, so friction falls more with the
    first kilojoule than with the next. w and k are zero unless the data require them.
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
        """Describes the decrease of Coulomb and viscous friction per stored heat."""
        assert joint is not None
        force, length = force_unit(robot, joint - 1), length_unit(robot, joint - 1)
        return (
            Coefficient("coulomb_fall", f"{force}/kJ"),
            Coefficient("viscous_fall", f"{force} s/{length}/kJ"),
        )

    def local(self, situation: Situation, joint: int, shape: tuple[float, ...] = ()) -> Array:
        """Evaluates -f sign(dq) and -f dq, f in kJ (N, 2)."""
        x = _kept(situation, joint, shape)
        return side_by_side([-x * situation.sign[:, joint - 1], -x * situation.dq[:, joint - 1]])

    def bounds(self, situation: Situation, joint: Place) -> tuple[tuple[float, float], ...]:
        """Bounds `fading` by the heat stored in these logs."""
        assert joint is not None
        time, weight, _ = super().bounds(situation, joint)
        # Time constant [s] of the stored heat that limits `fading`.
        most = float(heat(situation, joint, 400.0).max(initial=0.0))
        # Largest product of `fading` and that stored heat; the decrease of friction is then saturated.
        return time, weight, (0.0, 5.0 / most if most > 0 else 0.0)

    def forms(self, situation: Situation, joint: Place) -> tuple[tuple[float, ...], ...]:
        """Lists time constants, each with several housing weights."""
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
        """Returns the stored heat."""
        assert joint is not None
        return f"friction heat kept in joint {joint} [kJ]", _kept(situation, joint, shape)


def _more(shape: tuple[float, ...]) -> str:
    _, weight, fading = shape
    slow = (
        f", with a second part, {weight:.2g} times as large and {HOUSING_TIME_RATIO:.0f} times as slow"
        if weight > 0
        else ""
    )
    return slow + (f"; the effect saturates with exp(-x {fading:.2g}/kJ)" if fading > 0 else "")


def _kept(situation: Situation, joint: int, shape: tuple[float, ...]) -> Array:
    time, weight, fading = shape
    x = heat(situation, joint, time)
    if weight > 0:
        x = x + weight / HOUSING_TIME_RATIO * heat(situation, joint, HOUSING_TIME_RATIO * time)
    return -np.expm1(-fading * x) / fading if fading > 0 else x


def heat(situation: Situation, joint: int, time_constant: float) -> Array:
    """Integrates the base model's friction power to stored heat (N,) [kJ].

    Args:
        situation: the motion and the base model's torque (N samples).
        joint: the joint, counted from 1.
        time_constant: [s].
    """

    def integrate() -> Array:
        j = joint - 1
        # The fitted friction of a joint that hardly moves may have a wrong sign, but friction never cools.
        power = np.maximum(situation.friction[:, j] * situation.dq[:, j], 0.0)
        return relaxation(situation, power, time_constant) / 1000.0

    # Grid points are used repeatedly and cached; points of a search are used once.
    known = time_constant in ThermalFriction.shapes[0].grid
    return situation.cached(("heat", joint, time_constant), integrate) if known else integrate()

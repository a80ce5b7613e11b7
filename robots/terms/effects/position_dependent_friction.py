"""Friction that varies with the joint position, for example by a bent shaft, a worn spot or an eccentric bearing."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import casadi
import numpy as np

from robots.common.arrays import Array
from robots.terms.base import force_unit, length_unit
from robots.terms.effect_bases.base import Coefficient, Place, Shape, Situation
from robots.terms.effect_bases.static import Instant, StaticJointEffect

if TYPE_CHECKING:
    from robots.robot import Robot


HIGHEST = {"rad": 12.0, "m": 1000.0}
"""Highest order per turn, and highest wave number of a linear axis [rad/m]; above it the effect is a ripple."""
OVER = (1.5, 3.0, 5.0, 7.0, 10.0, 14.0, 20.0)
"""Phases [rad] over the range of a linear axis in a scan."""


class PositionDependentFriction(StaticJointEffect):
    """tau = sign(dq) (a cos(h q) + b sin(h q)), h in periods per turn; a wave number [rad/m] on a linear axis."""

    name: ClassVar[str] = "position_dependent_friction"
    title: ClassVar[str] = "position-dependent friction"
    shapes: ClassVar[tuple[Shape, ...]] = (
        Shape("order", "periods per turn", 0.5, HIGHEST["m"], "linear", (1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0)),
    )
    rivals: ClassVar[tuple[str, ...]] = ("load_dependent_friction", "torque_ripple", "presliding_hysteresis")
    experiments: ClassVar[tuple[str, ...]] = ("sweep", "payload")

    def parameters(self, robot: Robot, joint: Place) -> tuple[Coefficient, ...]:
        """Describes the amplitudes of cosine and sine."""
        assert joint is not None
        force = force_unit(robot, joint - 1)
        return Coefficient("cosine", force), Coefficient("sine", force)

    def grid(self, situation: Situation, joint: Place) -> tuple[tuple[float, ...], ...]:
        """Lists orders with at least a sixth of a period over the joint's range; by phase over it on a linear axis."""
        assert joint is not None
        reach = float(np.ptp(situation.q[:, joint - 1]))
        if length_unit(situation.robot, joint - 1) == "m":
            return tuple((phase / reach,) for phase in OVER if phase <= reach * HIGHEST["m"]) if reach else ()
        return tuple((order,) for order in self.shapes[0].grid if order * reach > 1.0)

    def bounds(self, situation: Situation, joint: Place) -> tuple[tuple[float, float], ...]:
        """Bounds the order below that of a ripple."""
        assert joint is not None
        return ((self.shapes[0].lower, HIGHEST[length_unit(situation.robot, joint - 1)]),)

    def likely(
        self, situation: Situation, joint: Place, shape: tuple[float, ...], coefficients: Array
    ) -> tuple[tuple[float | None, ...], ...]:
        """Lists the nearest whole order, if the joint's range does not distinguish it from the fitted one."""
        assert joint is not None
        order = max(float(round(shape[0])), 1.0)
        if length_unit(situation.robot, joint - 1) == "m":
            return ()
        reach = float(np.ptp(situation.q[:, joint - 1]))
        return ((order,),) if abs(order - shape[0]) * reach <= np.pi else ()

    def row(self, robot: Robot, joint: int, at: Instant) -> casadi.SX:
        """Builds sign(dq) cos(h q) and sign(dq) sin(h q)."""
        return casadi.horzcat(at.sign * casadi.cos(at.shape[0] * at.q), at.sign * casadi.sin(at.shape[0] * at.q))

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
        size, peak = np.hypot(*coefficients), np.arctan2(coefficients[1], coefficients[0]) / shape[0]
        often = f"{shape[0]:.3g} times per turn" if length == "rad" else f"every {2000 * np.pi / shape[0]:.4g} mm"
        return (
            f"The friction of joint {joint} varies with an amplitude of {size:.3g} {force}, {often}. "
            f"It is highest at {peak:.3g} {length}."
        )

    def coordinate(self, situation: Situation, joint: Place, shape: tuple[float, ...] = ()) -> tuple[str, Array]:
        """Returns the position."""
        assert joint is not None
        unit = length_unit(situation.robot, joint - 1)
        return f"position of joint {joint} [{unit}]", situation.q[:, joint - 1]

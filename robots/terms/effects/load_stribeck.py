"""Break-away friction that grows with the load."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import casadi
import numpy as np

from robots.common.arrays import Array
from robots.terms.base import length_unit
from robots.terms.effect_bases.base import Coefficient, Place, Shape, Situation
from robots.terms.effect_bases.capabilities import GearLoad
from robots.terms.effect_bases.states import moving_speed
from robots.terms.effect_bases.static import Instant, StaticJointEffect

if TYPE_CHECKING:
    from robots.robot import Robot


class LoadStribeck(StaticJointEffect):
    """tau = c |tau_L| exp(-|dq| / v_s) sign(dq) (Bittencourt and Gunnarsson 2012)."""

    name: ClassVar[str] = "load_stribeck"
    title: ClassVar[str] = "load-dependent break-away friction"
    gear_load: ClassVar[GearLoad] = GearLoad.FEELS
    needs_full_rate: ClassVar[bool] = True
    rare: ClassVar[bool] = True
    shapes: ClassVar[tuple[Shape, ...]] = (Shape("stribeck_velocity", "rad/s", 1e-3, 2.0, "log"),)
    rivals: ClassVar[tuple[str, ...]] = ("stribeck", "load_dependent_friction", "presliding_hysteresis")
    experiments: ClassVar[tuple[str, ...]] = ("payload", "sweep")

    def parameters(self, robot: Robot, joint: Place) -> tuple[Coefficient, ...]:
        """Describes the break-away friction per load."""
        return (Coefficient("share_of_load", "1"),)

    def grid(self, situation: Situation, joint: Place) -> tuple[tuple[float, ...], ...]:
        """Lists Stribeck velocities, spaced by factors of about 3, up to half the largest speed."""
        assert joint is not None
        slow, top = moving_speed(situation, joint)
        if top == 0.0:
            return ()
        lowest = min(max(slow, self.shapes[0].lower, top / 200), 0.5 * top)
        count = max(2, 1 + round(np.log(max(0.5 * top / lowest, 1.0)) / np.log(3)))
        return tuple((float(v),) for v in np.geomspace(lowest, 0.5 * top, count))

    def row(self, robot: Robot, joint: int, at: Instant) -> casadi.SX:
        """Builds |tau_L| exp(-|dq| / v_s) sign(dq)."""
        return casadi.fabs(at.load) * casadi.exp(-at.dq * at.sign / at.shape[0]) * at.sign

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
        than = "more" if coefficients[0] > 0 else "less"
        return (
            f"Joint {joint} needs {100 * abs(coefficients[0]):.3g} % of its load {than} to break away. The difference "
            f"fades "
            f"above {shape[0]:.3g} {length}/s."
        )

    def coordinate(self, situation: Situation, joint: Place, shape: tuple[float, ...] = ()) -> tuple[str, Array]:
        """Returns the velocity."""
        assert joint is not None
        unit = length_unit(situation.robot, joint - 1)
        return f"velocity of joint {joint} [{unit}/s]", situation.dq[:, joint - 1]

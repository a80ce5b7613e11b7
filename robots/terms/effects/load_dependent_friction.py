"""Friction that grows with the load on the gear."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import casadi
import numpy as np
from numpy.typing import NDArray

from robots.terms.base import length_unit
from robots.terms.effects.base import Coefficient, Place, Situation
from robots.terms.effects.static import Instant, StaticJointEffect

if TYPE_CHECKING:
    from robots.robot import Robot

Array = NDArray[np.float64]


class LoadDependentFriction(StaticJointEffect):
    """tau = |tau_L| (a sign(dq) + b dq), tau_L the torque that passes the gear (Hamon et al. 2010).

    The first column is also a gear's efficiency, better when driving than when driven.
    """

    name: ClassVar[str] = "load_dependent_friction"
    title: ClassVar[str] = "friction that grows with the load"
    rivals: ClassVar[tuple[str, ...]] = (
        "position_dependent_friction",
        "torque_constant_saturation",
        "load_stribeck",
        "presliding_hysteresis",
    )
    experiments: ClassVar[tuple[str, ...]] = ("payload", "second_base_pose")

    def parameters(self, robot: Robot, joint: Place) -> tuple[Coefficient, ...]:
        """Describes Coulomb and viscous friction per load."""
        assert joint is not None
        return Coefficient("coulomb_per_load", "1"), Coefficient(
            "viscous_per_load", f"s/{length_unit(robot, joint - 1)}"
        )

    def row(self, robot: Robot, joint: int, at: Instant) -> casadi.SX:
        """Builds |tau_L| sign(dq) and |tau_L| dq."""
        load = casadi.fabs(at.load)
        return casadi.horzcat(load * at.sign, load * at.dq)

    def describe(
        self,
        joint: Place,
        coefficients: Array,
        shape: tuple[float, ...] = (),
        *,
        force: str = "N m",
        length: str = "rad",
    ) -> str:
        """Says what the values mean."""
        return (
            f"The friction of joint {joint} grows with its load: {100 * coefficients[0]:.3g} % of it in Coulomb "
            f"friction, and {100 * coefficients[1]:.3g} % per {length}/s."
        )

    def coordinate(self, situation: Situation, joint: Place, shape: tuple[float, ...] = ()) -> tuple[str, Array]:
        """Gives the load times the direction of motion."""
        assert joint is not None
        j = joint - 1
        signed = np.abs(situation.load[:, j]) * situation.sign[:, j]
        return f"load of joint {joint}, signed by its direction [N m]", signed

"""Friction that grows with the load on the gear."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import casadi
import numpy as np

from robots.common.arrays import Array
from robots.terms.base import force_unit, length_unit
from robots.terms.effect_bases.base import Coefficient, Place, Shape, Situation
from robots.terms.effect_bases.capabilities import GearLoad
from robots.terms.effect_bases.static import Instant, StaticJointEffect
from robots.terms.effect_bases.unknown_rotor import KNOWN_ROTOR, ROTOR, load_beside, rotor_bounds, rotor_grid

if TYPE_CHECKING:
    from robots.robot import Robot


# Ratio of friction when the load drives the joint to friction when the joint drives the load, if both are equal.
EQUAL_FRICTION = 1.0


class LoadDependentFriction(StaticJointEffect):
    """tau = w |tau_L| (a sign(dq) + b dq), tau_L the gear load (Hamon et al. 2010).

    w is 1 while the joint drives its load, and `driven_back` while the load drives the joint: a gear has two
    efficiencies. Their difference is a torque proportional to tau_L itself, like an error of the torque constant. A
    rotor's inertia does not load the gear. This effect can therefore determine an unknown rotor of the first joints.
    """

    name: ClassVar[str] = "load_dependent_friction"
    title: ClassVar[str] = "load-dependent friction"
    gear_load: ClassVar[GearLoad] = GearLoad.FEELS
    shapes: ClassVar[tuple[Shape, ...]] = (
        Shape("driven_back", "1", 0.0, 1.0, "linear", (EQUAL_FRICTION,), 0.05, default=EQUAL_FRICTION),
        ROTOR,
    )
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

    def grid(self, situation: Situation, joint: Place) -> tuple[tuple[float, ...], ...]:
        """Lists a gear with equal friction in both power directions, for each rotor inertia of the scan."""
        assert joint is not None
        return tuple((EQUAL_FRICTION, rotor) for rotor in rotor_grid(situation, joint))

    def bounds(self, situation: Situation, joint: Place) -> tuple[tuple[float, float], ...]:
        """Bounds the rotor inertia to its known range."""
        assert joint is not None
        return (0.0, 1.0), rotor_bounds(situation, joint)

    def likely(
        self, situation: Situation, joint: Place, shape: tuple[float, ...], coefficients: Array
    ) -> tuple[tuple[float | None, ...], ...]:
        """Lists equal friction in both power directions, the known rotor, and both together."""
        return (EQUAL_FRICTION, KNOWN_ROTOR), (EQUAL_FRICTION, None), (None, KNOWN_ROTOR)

    def row(self, robot: Robot, joint: int, at: Instant) -> casadi.SX:
        """Builds w |tau_L| sign(dq) and w |tau_L| dq."""
        load = at.load - at.shape[1] * at.ddq
        drives = load * at.dq > 0
        size = (drives + (1.0 - drives) * at.shape[0]) * casadi.fabs(load)
        return casadi.horzcat(size * at.sign, size * at.dq)

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
        back = (
            ""
            if not shape or shape[0] == EQUAL_FRICTION
            else f" When the load drives the joint, the friction is {shape[0]:.2g} times as large."
        )
        change, (coulomb, viscous) = "grows", 100 * coefficients[:2]
        if coulomb < 0:
            change, coulomb, viscous = "falls", -coulomb, -viscous
        return (
            f"The friction of joint {joint} {change} with the load: Coulomb friction by {coulomb:.3g} % of the load, "
            f"viscous friction by "
            f"{viscous:.3g} % per {length}/s.{back}"
        )

    def coordinate(self, situation: Situation, joint: Place, shape: tuple[float, ...] = ()) -> tuple[str, Array]:
        """Returns the absolute load times the sign of velocity."""
        assert joint is not None
        j = joint - 1
        back, rotor = shape or (EQUAL_FRICTION, KNOWN_ROTOR)
        load = load_beside(situation, joint, rotor)
        signed = np.where(load * situation.dq[:, j] > 0, 1.0, back) * np.abs(load) * situation.sign[:, j]
        unit = force_unit(situation.robot, joint - 1)
        return f"load of joint {joint}, signed by its direction [{unit}]", signed

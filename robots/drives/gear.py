"""The gear: rotor inertia and friction, by the formulas of the catalogue of terms and effects."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import casadi
import numpy as np

from robots.drives.base import DriveParameter, Instant, Member, Values
from robots.terms import FrictionPolynomial
from robots.terms.effect_bases.static import Instant as EffectInstant
from robots.terms.effects import LoadDependentFriction, PositionDependentFriction, Stribeck

ALIKE, NO_ROTOR = 1.0, 0.0


@dataclass(frozen=True)
class Armature(Member):
    """The rotor's inertia, referred to the joint, takes ``armature ddq``."""

    name: ClassVar[str] = "armature"
    title: ClassVar[str] = "rotor inertia"

    def parameters(self) -> tuple[DriveParameter, ...]:
        """Describes the inertia."""
        return (DriveParameter(name="armature", unit="kg m2", upper=1e3, size=1e-2),)

    def transmit(self, signal: casadi.SX, now: Instant, values: Values) -> casadi.SX:
        """Builds the torque that is left."""
        return signal - values["armature"] * now.ddq


@dataclass(frozen=True)
class Friction(Member):
    """Coulomb and viscous friction, as `FrictionPolynomial` has it."""

    name: ClassVar[str] = "friction"
    title: ClassVar[str] = "friction"

    def parameters(self) -> tuple[DriveParameter, ...]:
        """Describes both coefficients."""
        viscous = DriveParameter(name="viscous", unit="N m s/rad", size=0.1)
        return viscous, DriveParameter(name="coulomb", unit="N m", size=0.1)

    def transmit(self, signal: casadi.SX, now: Instant, values: Values) -> casadi.SX:
        """Builds the torque that viscous friction leaves."""
        return signal - values["viscous"] * _polynomial(now)[1]

    def dry(self, now: Instant, values: Values) -> casadi.SX:
        """Builds Coulomb friction."""
        return values["coulomb"] * _polynomial(now)[0]


@dataclass(frozen=True)
class StribeckFriction(Member):
    """Dry friction that is larger at low speed, as the effect `Stribeck` with exponent 2 has it."""

    name: ClassVar[str] = "stribeck"
    title: ClassVar[str] = "Stribeck friction"

    def parameters(self) -> tuple[DriveParameter, ...]:
        """Describes the additional friction at rest, and the speed at which it fades."""
        torque = DriveParameter(name="stribeck", unit="N m", size=0.1)
        return torque, DriveParameter(
            name="stribeck_velocity", unit="rad/s", default=0.2, lower=0.01, upper=5.0, size=0.1
        )

    def dry(self, now: Instant, values: Values) -> casadi.SX:
        """Builds the additional dry friction."""
        at = _at(now, casadi.vertcat(values["stribeck_velocity"], 2.0))
        return values["stribeck"] * Stribeck().row(now.robot, now.joint, at)


@dataclass(frozen=True)
class LoadFriction(Member):
    """Friction that grows with the load on the gear, as the effect `LoadDependentFriction` has it."""

    name: ClassVar[str] = "load_friction"
    title: ClassVar[str] = "load-dependent friction"

    def parameters(self) -> tuple[DriveParameter, ...]:
        """Describes dry friction per load."""
        return (DriveParameter(name="load_coulomb", unit="1", upper=0.9, size=0.05),)

    def dry(self, now: Instant, values: Values) -> casadi.SX:
        """Builds the dry friction of the load."""
        at = _at(now, casadi.SX([ALIKE, NO_ROTOR]))
        return values["load_coulomb"] * LoadDependentFriction().row(now.robot, now.joint, at)[0]


@dataclass(frozen=True)
class PositionFriction(Member):
    """Dry friction that varies with the position, as the effect `PositionDependentFriction` has it.

    Linkages and gears that turn less than once show a part of a period.
    """

    name: ClassVar[str] = "position_friction"
    title: ClassVar[str] = "position-dependent friction"

    def parameters(self) -> tuple[DriveParameter, ...]:
        """Describes amplitudes of cosine and sine, and the periods per turn."""
        cosine, sine = (
            DriveParameter(name=f"friction_{name}", unit="N m", lower=-np.inf, size=0.1) for name in ("cosine", "sine")
        )
        order = DriveParameter(
            name="friction_order", unit="periods per turn", default=1.0, lower=0.5, upper=12.0, size=1.0
        )
        return cosine, sine, order

    def dry(self, now: Instant, values: Values) -> casadi.SX:
        """Builds the dry friction at the position."""
        columns = PositionDependentFriction().row(now.robot, now.joint, _at(now, values["friction_order"]))
        return values["friction_cosine"] * columns[0] + values["friction_sine"] * columns[1]


@dataclass(frozen=True)
class EndStop(Member):
    """Elastic stops at both ends of the range: torque grows from the position where the joint touches one."""

    name: ClassVar[str] = "end_stop"
    title: ClassVar[str] = "end stops"

    def parameters(self) -> tuple[DriveParameter, ...]:
        """Describes the positions of the stops, far away by default, and their stiffness."""
        return (
            DriveParameter(name="stop_lower", unit="rad", default=-1e3, lower=-1e4, upper=1e4, size=0.01),
            DriveParameter(name="stop_upper", unit="rad", default=1e3, lower=-1e4, upper=1e4, size=0.01),
            DriveParameter(name="stop_stiffness", unit="N m/rad", default=1e3, lower=1.0, size=1e3),
        )

    def transmit(self, signal: casadi.SX, now: Instant, values: Values) -> casadi.SX:
        """Builds the torque that is left."""
        beyond = casadi.fmax(now.measured - values["stop_upper"], 0) + casadi.fmin(
            now.measured - values["stop_lower"], 0
        )
        return signal - values["stop_stiffness"] * beyond


@dataclass(frozen=True)
class Offset(Member):
    """A constant torque, as the term `TorqueOffset` has it: a spring, a cable, or a command off by offset / kp."""

    name: ClassVar[str] = "offset"
    title: ClassVar[str] = "torque offset"

    def parameters(self) -> tuple[DriveParameter, ...]:
        """Describes the torque."""
        return (DriveParameter(name="torque_offset", unit="N m", lower=-np.inf, size=0.1),)

    def transmit(self, signal: casadi.SX, now: Instant, values: Values) -> casadi.SX:
        """Builds the torque that is left."""
        return signal - values["torque_offset"]


def _polynomial(now: Instant) -> casadi.SX:
    """Coulomb and viscous columns of a joint; the sign is what the simulation solves for, so it is 1 here."""
    return FrictionPolynomial(powers=(1, 2)).row(now.dq, casadi.SX(1), 0.0)


def _at(now: Instant, shape: casadi.SX) -> EffectInstant:
    one = casadi.SX(1)
    return EffectInstant(now.measured, now.dq, now.ddq, now.load, now.load, now.load, one, shape)

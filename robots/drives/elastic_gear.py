"""An elastic gear: motor and link are two masses with a spring between them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import casadi

from robots.drives.base import DriveParameter, Instant, Member, Values
from robots.terms.effects import JointElasticity


@dataclass(frozen=True)
class ElasticGear(Member):
    """The link is driven by ``stiffness twist + gear_damping twist'``, the twist being motor less link.

    Members before it belong to the motor: the law's torque, rotor inertia and friction. Those after it belong to the
    link. A flexible link that bends about its joint moves alike.

    Source:
        Spong 1987.
    """

    name: ClassVar[str] = JointElasticity.name
    title: ClassVar[str] = JointElasticity.title
    parts: ClassVar[bool] = True

    def parameters(self) -> tuple[DriveParameter, ...]:
        """Describes stiffness and damping of the gear."""
        return (
            DriveParameter(name="stiffness", unit="N m/rad", default=1e4, lower=1.0, upper=1e7, size=1e3),
            DriveParameter(name="gear_damping", unit="N m s/rad", default=1.0, lower=1e-6, upper=1e4, size=1.0),
        )

    def transmit(self, signal: casadi.SX, now: Instant, values: Values) -> casadi.SX:
        """Builds the torque on the link; what enters is the torque on the motor."""
        return values["stiffness"] * self.stretch(now.twist, values) + values["gear_damping"] * now.twist_rate

    def stretch(self, twist: casadi.SX, values: Values) -> casadi.SX:
        """Builds the part of the twist that the spring takes."""
        return twist

    def twist(self, load: casadi.SX, values: Values) -> casadi.SX:
        """Builds the twist at rest under a load."""
        return load / values["stiffness"]

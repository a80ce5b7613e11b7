"""A drive: a chain of members from the command to the joint, with the values of their parameters."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Literal

import casadi
import numpy as np

from robots.common.errors import InputError
from robots.drives.base import DriveParameter, Instant, Member, Values
from robots.drives.delay import Delay
from robots.drives.elastic_gear import ElasticGear
from robots.drives.gear import (
    Armature,
    EndStop,
    Friction,
    LoadFriction,
    Offset,
    PositionFriction,
    StribeckFriction,
)
from robots.drives.motor import MotorLimit

ENCODER = (
    DriveParameter(name="encoder_zero", unit="rad", lower=-0.3, upper=0.3, size=1e-2),
    DriveParameter(name="mass_factor", unit="1", default=1.0, lower=0.2, upper=5.0, size=0.1),
    DriveParameter(name="torque_constant", unit="N m/A", upper=1e6),
)
"""What every joint has beside its drive: the encoder's reading at zero, what scales the inertia of its link, and the
motor's torque at the joint per unit of a logged current; 0 where it is not known."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Drive:
    """The drive of one joint.

    Attributes:
        members: from the command to the joint; one of them is a control law.
        values: parameters by name; those that are not stated have their defaults.
        encoder: whether the encoder shows the motor, as on industrial arms, or the link, as on hobby servos. It matters
            with an elastic gear between them.

    Raises:
        InputError: a value of no member, or one that is not possible.
    """

    members: tuple[Member, ...]
    values: Mapping[str, float] = field(default_factory=dict)
    encoder: Literal["motor", "link"] = "motor"

    def __post_init__(self) -> None:
        known = {parameter.name: parameter for parameter in self.parameters}
        for name, value in self.values.items():
            if name not in known:
                raise InputError(f"drive parameter {name!r}", allowed=", ".join(known))
            if not known[name].lower <= value <= known[name].upper or not np.isfinite(value):
                raise InputError(
                    f"{name} {value:g} {known[name].unit}", allowed=f"{known[name].lower:g} to {known[name].upper:g}"
                )
        complete = {name: float(self.values.get(name, parameter.default)) for name, parameter in known.items()}
        object.__setattr__(self, "values", MappingProxyType(complete))

    @classmethod
    def usual(
        cls,
        law: Member,
        *,
        values: Mapping[str, float] | None = None,
        curve: bool = False,
        gear: ElasticGear | None = None,
        encoder: Literal["motor", "link"] = "motor",
    ) -> Drive:
        """Makes a drive of a delay, a law, a limited motor, and a gear with all effects; those not stated are zero.

        Args:
            law: the control law.
            values: of the parameters.
            curve: whether the motor's torque falls with its speed.
            gear: between motor and link; None for a rigid one.
            encoder: what the encoder shows.
        """
        motor = (Armature(), Friction(), StribeckFriction(), LoadFriction(), PositionFriction())
        between = () if gear is None else (gear,)
        members = (Delay(), law, MotorLimit(curve), *motor, *between, Offset(), EndStop())
        return cls(members=members, values=values or {}, encoder=encoder)

    @property
    def parameters(self) -> tuple[DriveParameter, ...]:
        """The members' parameters, then those of the encoder and the link."""
        return (*(parameter for member in self.members for parameter in member.parameters()), *ENCODER)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters."""
        return tuple(parameter.name for parameter in self.parameters)

    @property
    def states(self) -> tuple[str, ...]:
        """Names of the members' own states."""
        return tuple(state for member in self.members for state in member.states)

    @property
    def step(self) -> float:
        """Resolution of the command [rad or m]; 0 for a continuous one."""
        return max(member.steps() for member in self.members)

    @property
    def gear(self) -> ElasticGear | None:
        """The member that parts motor and link; None for a rigid gear."""
        return next((member for member in self.members if isinstance(member, ElasticGear)), None)

    def with_gear(self, gear: ElasticGear | None) -> Drive:
        """Gives the drive with another gear between its motor and its link; None for a rigid one."""
        members = [member for member in self.members if not isinstance(member, ElasticGear)]
        if gear is not None:
            # What belongs to the link comes after the gear.
            last = max((k for k, member in enumerate(members) if not isinstance(member, Offset | EndStop)), default=-1)
            members.insert(last + 1, gear)
        changed = replace(self, members=tuple(members), values={})
        return changed.with_values({name: value for name, value in self.values.items() if name in changed.names})

    def with_values(self, values: Mapping[str, float]) -> Drive:
        """Gives the drive with other values."""
        return replace(self, values={**self.values, **values})

    def torques(
        self, command: casadi.SX, motor: Instant, link: Instant, values: Values
    ) -> tuple[list[casadi.SX], casadi.SX, list[casadi.SX], casadi.SX]:
        """Builds what the drive does.

        Args:
            command: the delayed command.
            motor: state of the motor, which is that of the joint without an elastic gear.
            link: state of the link.
            values: parameters by name.

        Returns:
            The torque on the link without dry friction; with an elastic gear that on the motor, less what the gear
            takes, and that on the link. Then the size of dry friction, the rates of the states, and the motor's torque.
        """
        signal, dry, rates, effort = command, casadi.SX(0), dict[str, casadi.SX](), casadi.SX(0)
        torques, now = list[casadi.SX](), motor
        for member in self.members:
            rates |= member.rates(signal, now, values)
            sent = member.transmit(signal, now, values)
            if member.parts:
                torques.append(signal - sent)
                now = link
            signal = sent
            if isinstance(member, MotorLimit):
                effort = signal
            dry = dry + member.dry(now, values)
        return [*torques, signal], dry, [rates[name] for name in self.states], effort

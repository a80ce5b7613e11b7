"""Velocity loop with a proportional and an integral part."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import casadi

from robots.drives.base import DriveParameter, Instant, Member, Values

KV = DriveParameter(name="kv", unit="N m s/rad", default=1.0, lower=1e-6, size=1.0)
KI = DriveParameter(name="ki", unit="N m/rad", size=10.0)


@dataclass(frozen=True)
class VelocityLaw(Member):
    """tau = kv (dq_ref - dq) + ki integral(dq_ref - dq); the command is a velocity."""

    name: ClassVar[str] = "velocity"
    title: ClassVar[str] = "velocity loop with PI"
    states: ClassVar[tuple[str, ...]] = ("velocity_error",)

    def parameters(self) -> tuple[DriveParameter, ...]:
        """Describes the gains."""
        return KV, KI

    def transmit(self, signal: casadi.SX, now: Instant, values: Values) -> casadi.SX:
        """Builds the torque of a velocity command."""
        return values["kv"] * (signal - now.measured_rate) + values["ki"] * now.state["velocity_error"]

    def rates(self, signal: casadi.SX, now: Instant, values: Values) -> dict[str, casadi.SX]:
        """Builds the velocity error, which the loop integrates."""
        return {"velocity_error": signal - now.measured_rate}

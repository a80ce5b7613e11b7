"""Proportional and derivative control in torque, as quadrupeds and humanoids have it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import casadi

from robots.drives.base import DriveParameter, Instant, Member, Values

KP = DriveParameter(name="kp", unit="N m/rad", default=20.0, lower=1e-6, size=10.0)
KD = DriveParameter(name="kd", unit="N m s/rad", default=1.0, size=0.5)


@dataclass(frozen=True)
class PdLaw(Member):
    """tau = kp (q_ref - q) - kd dq."""

    name: ClassVar[str] = "pd"
    title: ClassVar[str] = "PD control in torque"

    def parameters(self) -> tuple[DriveParameter, ...]:
        """Describes the gains."""
        return KP, KD

    def transmit(self, signal: casadi.SX, now: Instant, values: Values) -> casadi.SX:
        """Builds the torque of a position command."""
        return values["kp"] * (signal - now.measured) - values["kd"] * now.dq

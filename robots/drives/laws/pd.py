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
    """tau = kp e' - kd dq, e' = q_ref - q without the part within the dead band on either side."""

    name: ClassVar[str] = "pd"
    title: ClassVar[str] = "PD control in torque"

    def parameters(self) -> tuple[DriveParameter, ...]:
        """Describes gains and dead band."""
        return KP, KD, DriveParameter(name="dead_band", unit="rad", upper=0.2, size=5e-3)

    def transmit(self, signal: casadi.SX, now: Instant, values: Values) -> casadi.SX:
        """Builds the torque of a position command."""
        error, band = signal - now.measured, values["dead_band"]
        outside = error - casadi.fmax(casadi.fmin(error, band), -band)
        return values["kp"] * outside - values["kd"] * self.rate(now)

    def rate(self, now: Instant) -> casadi.SX:
        """Gives the velocity that damps: that of the encoder, from which the controller computes it."""
        return now.measured_rate

"""Position servo of hobby class: integer steps, a dead band, and a derivative part that is mostly back-EMF."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import casadi

from robots.drives.base import DriveParameter, Instant, Member, Values
from robots.drives.laws.pd import KD, KP


@dataclass(frozen=True)
class ServoLaw(Member):
    """tau = kp e' - kd dq, e' = q_ref - q without the part within the dead band on either side.

    Attributes:
        step: resolution of the command [rad or m], such as 2 pi / 4096; 0 for a continuous one.
    """

    step: float = 0.0
    name: ClassVar[str] = "servo"
    title: ClassVar[str] = "position servo"

    def parameters(self) -> tuple[DriveParameter, ...]:
        """Describes gains and dead band."""
        return KP, KD, DriveParameter(name="dead_band", unit="rad", upper=0.2, size=5e-3)

    def transmit(self, signal: casadi.SX, now: Instant, values: Values) -> casadi.SX:
        """Builds the torque of a position command."""
        error, band = signal - now.measured, values["dead_band"]
        outside = error - casadi.fmax(casadi.fmin(error, band), -band)
        return values["kp"] * outside - values["kd"] * now.dq

    def steps(self) -> float:
        """Returns the resolution of the command."""
        return self.step

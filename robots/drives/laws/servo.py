"""Position servo of hobby class, whose command has integer steps."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import casadi

from robots.drives.base import Instant
from robots.drives.laws.pd import PdLaw


@dataclass(frozen=True)
class ServoLaw(PdLaw):
    """tau = kp e' - kd dq as `PdLaw` has it, of a command that is rounded to steps.

    The derivative part is mostly the motor's back-EMF, so it is the motor's velocity that damps, whatever the encoder
    shows.

    Attributes:
        step: resolution of the command [rad or m], such as 2 pi / 4096; 0 for a continuous one.
    """

    step: float = 0.0
    name: ClassVar[str] = "servo"
    title: ClassVar[str] = "position servo"

    def rate(self, now: Instant) -> casadi.SX:
        """Gives the velocity of the motor."""
        return now.dq

    def steps(self) -> float:
        """Returns the resolution of the command."""
        return self.step

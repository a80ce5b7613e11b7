"""What a motor can do: a largest torque, and a torque that falls with the speed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import casadi
import numpy as np

from robots.drives.base import DriveParameter, Instant, Member, Values


@dataclass(frozen=True)
class MotorLimit(Member):
    """The torque is clamped to +-torque_limit.

    With `curve` it is also clamped to what a direct-current motor has left at its speed:
    ``stall_torque (1 - dq / no_load_speed)`` in the direction of motion.

    Attributes:
        curve: whether the torque falls with the speed.
    """

    curve: bool = False
    name: ClassVar[str] = "motor"
    title: ClassVar[str] = "limits of the motor"

    def parameters(self) -> tuple[DriveParameter, ...]:
        """Describes the limits."""
        limit = DriveParameter(name="torque_limit", unit="N m", default=1e6, lower=1e-6, size=10.0)
        if not self.curve:
            return (limit,)
        stall = DriveParameter(name="stall_torque", unit="N m", default=1e6, lower=1e-6, size=10.0)
        return limit, stall, DriveParameter(name="no_load_speed", unit="rad/s", default=1e6, lower=1e-3, upper=np.inf)

    def transmit(self, signal: casadi.SX, now: Instant, values: Values) -> casadi.SX:
        """Builds the clamped torque."""
        upper, lower = values["torque_limit"], -values["torque_limit"]
        if self.curve:
            share = now.dq / values["no_load_speed"]
            upper = casadi.fmax(0, casadi.fmin(upper, values["stall_torque"] * (1 - share)))
            lower = casadi.fmin(0, casadi.fmax(lower, values["stall_torque"] * (-1 - share)))
        return casadi.fmax(casadi.fmin(signal, upper), lower)

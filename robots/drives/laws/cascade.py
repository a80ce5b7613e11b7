"""Cascade of industrial drives: a position loop commands the velocity loop."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import casadi

from robots.drives.base import DriveParameter, Instant, Member, Values
from robots.drives.laws.velocity import KI, KV

KR = DriveParameter(name="kr", unit="1/s", default=20.0, lower=1e-6, size=10.0)


@dataclass(frozen=True)
class CascadeLaw(Member):
    """tau = kv e + ki integral(e), e = kr (q_ref - q) - dq."""

    name: ClassVar[str] = "cascade"
    title: ClassVar[str] = "position loop over a velocity loop with PI"
    states: ClassVar[tuple[str, ...]] = ("velocity_error",)

    def parameters(self) -> tuple[DriveParameter, ...]:
        """Describes the gains."""
        return KR, KV, KI

    def transmit(self, signal: casadi.SX, now: Instant, values: Values) -> casadi.SX:
        """Builds the torque of a position command."""
        return values["kv"] * self._error(signal, now, values) + values["ki"] * now.state["velocity_error"]

    def rates(self, signal: casadi.SX, now: Instant, values: Values) -> dict[str, casadi.SX]:
        """Builds the velocity error, which the loop integrates."""
        return {"velocity_error": self._error(signal, now, values)}

    def _error(self, signal: casadi.SX, now: Instant, values: Values) -> casadi.SX:
        return values["kr"] * (signal - now.measured) - now.measured_rate

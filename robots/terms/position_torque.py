"""A torque by the joint's own position, of unknown cause: a cable, a spring, a balancer, a sensor's error."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import casadi
import numpy as np
from numpy.typing import NDArray

from robots.terms.base import Column, Term, force_unit

if TYPE_CHECKING:
    from robots.robot import Robot

HARMONICS = (1, 2)


@dataclass(frozen=True)
class PositionTorque(Term):
    """tau = s1 sin(q) + c1 cos(q) + s2 sin(2 q) + c2 cos(2 q) on each joint; a linear axis' q counts in metres.

    It says nothing of the cause. `diagnose` looks for that.
    """

    name: str = "position_torque"

    def columns(self, robot: Robot) -> tuple[Column, ...]:
        """Describes the four coefficients of each joint."""
        return tuple(
            Column(
                name=f"{symbol}_{joint}",
                symbol=symbol,
                joint=joint,
                unit=force_unit(robot, joint - 1),
                term=self.name,
            )
            for joint in range(1, robot.n + 1)
            for symbol in (f"{kind}{k}" for k in HARMONICS for kind in ("sin", "cos"))
        )

    def regressor(self, robot: Robot, q: casadi.SX, dq: casadi.SX, ddq: casadi.SX) -> casadi.SX:
        """Builds Y (n, 4 n), block diagonal."""
        rows = [
            casadi.horzcat(*(shape(k * q[joint]) for k in HARMONICS for shape in (casadi.sin, casadi.cos)))
            for joint in range(robot.n)
        ]
        return casadi.diagcat(*rows)

    def nominal(self, robot: Robot) -> NDArray[np.float64]:
        """Returns zeros (4 n,), because a description states none of it."""
        return np.zeros(4 * robot.n)

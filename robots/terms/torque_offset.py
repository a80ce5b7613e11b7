"""A constant torque per joint: the zero of a sensor or current loop, or direction-dependent Coulomb friction."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import casadi
import numpy as np
from numpy.typing import NDArray

from robots.terms.base import Column, Term, force_unit, joint_columns

if TYPE_CHECKING:
    from robots.robot import Robot


@dataclass(frozen=True)
class TorqueOffset(Term):
    """tau = offset on each joint."""

    name: str = "torque_offset"

    def columns(self, robot: Robot) -> tuple[Column, ...]:
        """Describes the offset of each joint."""
        return joint_columns(robot, self.name, "offset", [force_unit(robot, joint) for joint in range(robot.n)])

    def regressor(self, robot: Robot, q: casadi.SX, dq: casadi.SX, ddq: casadi.SX) -> casadi.SX:
        """Builds Y (n, n), the identity."""
        return casadi.SX.eye(robot.n)

    def nominal(self, robot: Robot) -> NDArray[np.float64]:
        """Returns zeros (n,), because a description states no offset."""
        return np.zeros(robot.n)

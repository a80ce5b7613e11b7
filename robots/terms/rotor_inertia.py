"""Rotor inertia, referred to the joint."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import casadi
import numpy as np
from numpy.typing import NDArray

from robots.terms.base import Column, Term, joint_columns

if TYPE_CHECKING:
    from robots.robot import Robot


@dataclass(frozen=True)
class RotorInertia(Term):
    """tau_m = Im ddq on each joint, Im the motor's inertia times its gear ratio squared (thesis eq. 37).

    The rotor's gyroscopic torque on the preceding links is neglected, as in the thesis. It is smaller by the gear
    ratio.
    """

    name: str = "rotor_inertia"

    def columns(self, robot: Robot) -> tuple[Column, ...]:
        """Describes Im of each joint."""
        units = ["kg m2" if joint.kind == "revolute" else "kg" for joint in robot.chain.joints]
        return joint_columns(robot, self.name, "Im", units)

    def regressor(self, robot: Robot, q: casadi.SX, dq: casadi.SX, ddq: casadi.SX) -> casadi.SX:
        """Builds Y (n, n), diagonal."""
        return casadi.diag(ddq)

    def nominal(self, robot: Robot) -> NDArray[np.float64]:
        """Returns the rotor inertias of the robot's description (n,)."""
        return np.asarray(robot.rotor_inertia, dtype=float)

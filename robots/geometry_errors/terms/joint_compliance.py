"""Joint compliance: gears and belts give way under the torque of gravity."""

from __future__ import annotations

import numpy as np

from robots.common.arrays import Array
from robots.geometry_errors.state import ArmState
from robots.geometry_errors.terms.base import Column, ErrorParameter, ErrorTerm, one_each, parameter
from robots.robot import MASSES_REMEDY, Robot

NEGLIGIBLE = 1e-9  # of the largest moment; a vertical axis carries no moment of gravity beyond rounding


class JointCompliance(ErrorTerm):
    """``q = q_read + compliance * torque of gravity``: one parameter per joint [rad/(N m) or m/N]."""

    kind = "joint_compliance"
    title = "joint compliance"

    def parameters(self, robot: Robot, state: ArmState) -> tuple[ErrorParameter, ...]:
        """Lists ``joint_compliance_1`` to ``joint_compliance_n``."""
        return tuple(
            parameter(f"joint_compliance_{i + 1}", self.kind, i, "m/N" if kind == "prismatic" else "rad/(N m)", 1e-4)
            for i, kind in enumerate(robot.chain.kinds)
        )

    def missing(self, robot: Robot, state: ArmState) -> str:
        """Says that masses are not known."""
        return "" if state.load is not None else f"the masses of the links ({MASSES_REMEDY})"

    def columns(self, robot: Robot, state: ArmState) -> tuple[Column, ...]:
        """Gives twists along the axes in proportion to the torque."""
        return one_each(robot, self.parameters(robot, state), axis_loads(robot, state), range(robot.n))


def axis_loads(robot: Robot, state: ArmState) -> Array:
    """Gravity's moment about each axis, or force along it (N, n) [N m or N]; exactly 0 where it is rounding."""
    assert state.load is not None
    parts = [
        state.load[:, i, slice(0, 3) if joint.kind == "prismatic" else slice(3, 6)] @ joint.axis
        for i, joint in enumerate(robot.chain.joints)
    ]
    torque = np.column_stack(parts)
    if torque.dtype == object:
        return torque  # Expressions have no size.
    torque[:, np.abs(torque).max(axis=0, initial=0.0) < NEGLIGIBLE * np.abs(state.load).max(initial=0.0)] = 0.0
    return torque

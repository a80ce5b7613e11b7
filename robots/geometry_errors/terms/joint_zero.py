"""Joint zeros: the joint stands elsewhere than its encoder says, by a constant."""

from __future__ import annotations

import numpy as np

from robots.geometry_errors.state import ArmState
from robots.geometry_errors.terms.base import Column, ErrorParameter, ErrorTerm, joint_unit, one_each, parameter
from robots.robot import Robot


class JointZero(ErrorTerm):
    """``q = q_read + zero``: one parameter per joint [rad or m]."""

    kind = "joint_zero"
    title = "joint zeros"
    constant = True

    def parameters(self, robot: Robot, state: ArmState) -> tuple[ErrorParameter, ...]:
        """Lists ``zero_1`` to ``zero_n``."""
        return tuple(
            parameter(f"zero_{i + 1}", self.kind, i, joint_unit(robot, i), 0.001 if kind == "prismatic" else 0.005)
            for i, kind in enumerate(robot.chain.kinds)
        )

    def columns(self, robot: Robot, state: ArmState) -> tuple[Column, ...]:
        """Gives constant twists along the axes."""
        return one_each(robot, self.parameters(robot, state), np.ones((1, robot.n)), range(robot.n))

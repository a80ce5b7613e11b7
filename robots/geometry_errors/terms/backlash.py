"""Backlash: the joint stops on the side of the gap from which it came."""

from __future__ import annotations

import numpy as np

from robots.geometry_errors.state import ArmState
from robots.geometry_errors.terms.base import Column, ErrorParameter, ErrorTerm, joint_unit, one_each, parameter
from robots.robot import Robot


class Backlash(ErrorTerm):
    """``q = q_read - gap / 2 * direction of approach``: one gap per joint [rad or m]."""

    kind = "backlash"
    title = "backlash"

    def parameters(self, robot: Robot, state: ArmState) -> tuple[ErrorParameter, ...]:
        """Lists ``gap_1`` to ``gap_n``."""
        return tuple(parameter(f"gap_{i + 1}", self.kind, i, joint_unit(robot, i), 1e-3) for i in range(robot.n))

    def missing(self, robot: Robot, state: ArmState) -> str:
        """Says that the direction of approach is not known."""
        return "" if state.approach is not None and np.any(state.approach) else "the directions of approach"

    def columns(self, robot: Robot, state: ArmState) -> tuple[Column, ...]:
        """Gives twists along the axes against the direction of approach."""
        assert state.approach is not None
        return one_each(robot, self.parameters(robot, state), -0.5 * state.approach, range(robot.n))

"""Backlash under load: gravity, not the direction of approach, decides on which side of the gap the joint lies."""

from __future__ import annotations

import numpy as np

from robots.geometry_errors.state import ArmState
from robots.geometry_errors.terms.base import Column, ErrorParameter, ErrorTerm, joint_unit, one_each, parameter
from robots.geometry_errors.terms.joint_compliance import axis_loads
from robots.robot import MASSES_REMEDY, Robot

BALANCED = 0.02  # of the largest torque; below it the joint may lie anywhere in the gap


class LoadBacklash(ErrorTerm):
    """``q = q_read + gap / 2 * side of gravity's torque``: one gap per joint [rad or m].

    A gear without much friction falls to the side to which gravity pulls, wherever it came from.
    """

    kind = "load_backlash"
    title = "backlash by load"

    def parameters(self, robot: Robot, state: ArmState) -> tuple[ErrorParameter, ...]:
        """Lists ``load_gap_1`` to ``load_gap_n``."""
        return tuple(parameter(f"load_gap_{i + 1}", self.kind, i, joint_unit(robot, i), 1e-3) for i in range(robot.n))

    def missing(self, robot: Robot, state: ArmState) -> str:
        """Says that masses are not known."""
        return "" if state.load is not None else f"the masses of the links ({MASSES_REMEDY})"

    def columns(self, robot: Robot, state: ArmState) -> tuple[Column, ...]:
        """Gives twists along the axes to the side of the torque; where it is always one, this is a joint zero."""
        torque = axis_loads(robot, state)
        largest = np.abs(torque).max(axis=0, initial=np.finfo(float).tiny)
        side = 0.5 * np.clip(torque / (BALANCED * largest), -1.0, 1.0)
        return one_each(robot, self.parameters(robot, state), side, range(robot.n))

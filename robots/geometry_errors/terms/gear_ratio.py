"""Gear ratios: a joint turns by more or less than its encoder counts, in proportion."""

from __future__ import annotations

from robots.geometry_errors.state import ArmState
from robots.geometry_errors.terms.base import Column, ErrorParameter, ErrorTerm, one_each, parameter
from robots.robot import Robot


class GearRatio(ErrorTerm):
    """``q = (1 + ratio) q_read``: one relative error per joint."""

    kind = "gear_ratio"
    title = "gear ratios"

    def parameters(self, robot: Robot, state: ArmState) -> tuple[ErrorParameter, ...]:
        """Lists ``ratio_1`` to ``ratio_n``."""
        return tuple(parameter(f"ratio_{i + 1}", self.kind, i, "1", 1e-3) for i in range(robot.n))

    def columns(self, robot: Robot, state: ArmState) -> tuple[Column, ...]:
        """Gives twists along the axes that grow with the position."""
        return one_each(robot, self.parameters(robot, state), state.q, range(robot.n))

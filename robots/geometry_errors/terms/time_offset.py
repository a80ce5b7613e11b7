"""Time offset: the clock of the tracker runs behind or ahead of the robot's, while the arm moves."""

from __future__ import annotations

import numpy as np

from robots.geometry_errors.state import ArmState
from robots.geometry_errors.terms.base import Column, ErrorParameter, ErrorTerm, along_axis, parameter
from robots.robot import Robot


class TimeOffset(ErrorTerm):
    """``q = q_read + offset * velocity``, the same offset for all joints [s]."""

    kind = "time_offset"
    title = "time offset"

    def parameters(self, robot: Robot, state: ArmState) -> tuple[ErrorParameter, ...]:
        """Lists ``time_offset``."""
        return (parameter("time_offset", self.kind, None, "s", 1e-3),)

    def missing(self, robot: Robot, state: ArmState) -> str:
        """Says that the arm stood still, or that its velocity is not known."""
        return "" if state.velocity is not None and np.any(state.velocity) else "velocities (columns dq1..dqn)"

    def columns(self, robot: Robot, state: ArmState) -> tuple[Column, ...]:
        """Gives twists of all joints along their axes in proportion to their velocity."""
        assert state.velocity is not None
        twists = tuple((i, along_axis(robot, i, state.velocity[:, i])) for i in range(robot.n))
        return (Column(parameter=self.parameters(robot, state)[0], twists=twists),)

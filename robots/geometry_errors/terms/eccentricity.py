"""Eccentricity: an encoder or gear off its axis adds an error of once per turn of the joint."""

from __future__ import annotations

import numpy as np

from robots.geometry_errors.state import ArmState
from robots.geometry_errors.terms.base import Column, ErrorParameter, ErrorTerm, one_each, parameter
from robots.robot import Robot


class Eccentricity(ErrorTerm):
    """``q = q_read + sine sin(q_read) + cosine cos(q_read)``: two parameters [rad] per joint that turns."""

    kind = "eccentricity"
    title = "eccentricity, once per turn"

    def parameters(self, robot: Robot, state: ArmState) -> tuple[ErrorParameter, ...]:
        """Lists ``sine_i`` and ``cosine_i`` of each joint i that turns."""
        return tuple(
            parameter(f"{part}_{i + 1}", self.kind, i, "rad", 1e-3)
            for i in _turning(robot)
            for part in ("sine", "cosine")
        )

    def columns(self, robot: Robot, state: ArmState) -> tuple[Column, ...]:
        """Gives twists along the axes, once per turn."""
        turning = _turning(robot)
        both = np.stack([np.sin(state.q[:, turning]), np.cos(state.q[:, turning])], axis=-1)
        return one_each(
            robot, self.parameters(robot, state), both.reshape(state.rows, -1), np.repeat(turning, 2).tolist()
        )


def _turning(robot: Robot) -> list[int]:
    return [i for i, kind in enumerate(robot.chain.kinds) if kind == "revolute"]

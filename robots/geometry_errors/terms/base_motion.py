"""Base motion: between two sessions the robot was moved, or the tracker was."""

from __future__ import annotations

import numpy as np

from robots.geometry_errors.state import ArmState
from robots.geometry_errors.terms.base import Column, ErrorParameter, ErrorTerm, parameter
from robots.geometry_errors.twists import adjoint, inverse
from robots.robot import Robot


class BaseMotion(ErrorTerm):
    """In every session but the first the base stands elsewhere by a pose of its own: six parameters each."""

    kind = "base_motion"
    title = "base moved between sessions"

    def parameters(self, robot: Robot, state: ArmState) -> tuple[ErrorParameter, ...]:
        """Lists ``base_k_x`` to ``base_k_rz`` of each session k from 2."""
        return tuple(
            parameter(f"base_{session}_{axis}", self.kind, None, "m" if k < 3 else "rad", 1e-3)
            for session in _later(state)
            for k, axis in enumerate(("x", "y", "z", "rx", "ry", "rz"))
        )

    def missing(self, robot: Robot, state: ArmState) -> str:
        """Says that there is one session only."""
        return "" if _later(state) else "a second session (column session)"

    def columns(self, robot: Robot, state: ArmState) -> tuple[Column, ...]:
        """Gives unit twists of the base frame at the poses of each session."""
        assert state.session is not None
        # In the axes of the first joint frame, which the base carries.
        units = adjoint(inverse(robot.chain.joints[0].placement))
        items = iter(self.parameters(robot, state))
        return tuple(
            Column(parameter=next(items), twists=((0, (state.session == session)[:, None] * units[:, k]),))
            for session in _later(state)
            for k in range(6)
        )


def _later(state: ArmState) -> list[int]:
    return [] if state.session is None else [int(session) for session in np.unique(state.session)[1:]]

"""Link placements: a joint frame is elsewhere on its parent link than the description says, by a constant pose."""

from __future__ import annotations

import numpy as np

from robots.geometry_errors.state import ArmState
from robots.geometry_errors.terms.base import Column, ErrorParameter, ErrorTerm, parameter
from robots.robot import Robot

SHIFT, TURN = 1e-3, 1e-3  # usual sizes [m, rad]
AXES = ("x", "y", "z", "rx", "ry", "rz")


class LinkPlacement(ErrorTerm):
    """Six parameters per joint: shifts and turns in the axes of the joint frame.

    Many move the flange as others do: what no pose distinguishes is left out by the rank of the Jacobian. With parallel
    axes this leaves the turns of Hayati (1983) without a rule of their own.
    """

    kind = "link_placement"
    title = "link placements"
    constant = True
    of_link = True
    includes = ("joint_zero",)

    def parameters(self, robot: Robot, state: ArmState) -> tuple[ErrorParameter, ...]:
        """Lists ``link_i_x`` to ``link_i_rz`` of each joint i."""
        return tuple(
            parameter(f"link_{i + 1}_{axis}", self.kind, i, "m" if k < 3 else "rad", SHIFT if k < 3 else TURN)
            for i in range(robot.n)
            for k, axis in enumerate(AXES)
        )

    def columns(self, robot: Robot, state: ArmState) -> tuple[Column, ...]:
        """Gives constant unit twists."""
        units = np.eye(6)[:, None, :]
        return tuple(
            Column(parameter=item, twists=((k // 6, units[k % 6]),))
            for k, item in enumerate(self.parameters(robot, state))
        )

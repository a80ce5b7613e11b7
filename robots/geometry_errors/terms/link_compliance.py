"""Link compliance: links and bearings bend and twist under the moment of gravity, across the joint's axis."""

from __future__ import annotations

import numpy as np

from robots.geometry_errors.state import ArmState
from robots.geometry_errors.terms.base import Column, ErrorParameter, ErrorTerm, parameter
from robots.robot import MASSES_REMEDY, Robot


class LinkCompliance(ErrorTerm):
    """The frame of joint i turns by ``compliance * moment`` across its axis: one parameter per joint [rad/(N m)].

    Along the axis of a joint that turns, it cannot be distinguished from the joint's own compliance. A joint that
    slides bends in all three directions.
    """

    kind = "link_compliance"
    title = "link compliance"

    def parameters(self, robot: Robot, state: ArmState) -> tuple[ErrorParameter, ...]:
        """Lists ``link_compliance_1`` to ``link_compliance_n``."""
        return tuple(parameter(f"link_compliance_{i + 1}", self.kind, i, "rad/(N m)", 1e-4) for i in range(robot.n))

    def missing(self, robot: Robot, state: ArmState) -> str:
        """Says that masses are not known."""
        return "" if state.load is not None else f"the masses of the links ({MASSES_REMEDY})"

    def columns(self, robot: Robot, state: ArmState) -> tuple[Column, ...]:
        """Gives turns of the joint frames in proportion to the moment across the axis."""
        assert state.load is not None
        columns = []
        for i, (item, joint) in enumerate(zip(self.parameters(robot, state), robot.chain.joints, strict=True)):
            moment = state.load[:, i, 3:]
            across = np.eye(3) - (np.outer(joint.axis, joint.axis) if joint.kind == "revolute" else 0.0)
            twist = np.hstack([np.zeros_like(moment), moment @ across])
            columns.append(Column(parameter=item, twists=((i, twist),)))
        return tuple(columns)

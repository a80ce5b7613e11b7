"""Thermal growth: links get longer with temperature."""

from __future__ import annotations

import numpy as np

from robots.geometry_errors.state import ArmState
from robots.geometry_errors.terms.base import Column, ErrorParameter, ErrorTerm, parameter
from robots.robot import Robot


class ThermalGrowth(ErrorTerm):
    """The shift from one joint to the next grows by ``expansion * (temperature - reference)``: one per link [1/K].

    A link of steel has 12e-6/K, one of aluminium 23e-6/K. Links without length have no parameter.
    """

    kind = "thermal_growth"
    title = "thermal growth"

    def parameters(self, robot: Robot, state: ArmState) -> tuple[ErrorParameter, ...]:
        """Lists ``expansion_i`` of each link i with a length."""
        return tuple(parameter(f"expansion_{i + 1}", self.kind, i, "1/K", 1e-5) for i in _long(robot))

    def missing(self, robot: Robot, state: ArmState) -> str:
        """Says that there is no temperature, or none that changes."""
        if state.temperature is None:
            return "a column temp"
        return "" if np.ptp(state.temperature) > 0.0 else "a temperature that changes"

    def columns(self, robot: Robot, state: ArmState) -> tuple[Column, ...]:
        """Gives shifts of the joint frames along their links."""
        assert state.temperature is not None
        columns = []
        for i, item in zip(_long(robot), self.parameters(robot, state), strict=True):
            joint = robot.chain.joints[i]
            along = joint.rotation.T @ joint.translation
            twist = np.hstack([state.temperature[:, None] * along, np.zeros((state.rows, 3))])
            columns.append(Column(parameter=item, twists=((i, twist),)))
        return tuple(columns)


def _long(robot: Robot) -> list[int]:
    return [i for i, joint in enumerate(robot.chain.joints) if np.any(joint.translation)]

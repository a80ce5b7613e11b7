"""Logs that do not determine inertias or friction."""

from __future__ import annotations

from typing import ClassVar

from estimation.gate.check import Check
from estimation.gate.context import Context, Stage
from estimation.gate.finding import Finding
from robots.common.plain import joints_in_words
from robots.robot import Robot

# Decrease of the held-out error (log) that velocities and accelerations must bring. With some 300 independent rows this
# is three standard errors of their torque.
LEAST = 0.015
# Held-out error over the torque's standard deviation up to which a joint is judged: others are reported as they are.
EXPLAINED = 0.3


class Undetermined(Check):
    """Names the joints whose torques are explained as well without velocities and accelerations.

    It is said if most joints are concerned: a light joint by itself may hide its inertia behind friction. The log may
    fit well: slow motions show gravity and friction. A model of them fails at usual speeds, because the
    inertias are below some three standard errors.
    """

    name: ClassVar[str] = "undetermined"
    stage: ClassVar[Stage] = Stage.FITTED
    order: ClassVar[int] = 55

    def run(self, context: Context) -> list[Finding]:
        """Lists the joints, but not those that are poorly explained altogether."""
        bad = {finding.joint for finding in context.found(("badly_excited",))}
        gain = context.fitted.dynamic_gain
        well = context.fitted.unexplained < EXPLAINED
        weak = [j for j in range(context.robot.n) if j + 1 not in bad and well[j] and gain[j] < LEAST]
        if 2 * len(weak) <= context.robot.n:
            return []
        return [
            Finding(
                name="undetermined",
                severity="warning",
                text=f"the log does not determine the inertia of {_joints(context.robot, weak)}: torques are explained "
                "as well without accelerations",
                action="the inertias are then below some 3 standard errors, and predictions of faster motions are "
                "wrong; add a log of faster motions",
                value=100 * float(gain[weak].min()),
                unit="%",
                joint=weak[0] + 1 if len(weak) == 1 else None,
            )
        ]


def _joints(robot: Robot, joints: list[int]) -> str:
    if len(joints) == robot.n and robot.n > 1:
        return "all joints"
    return joints_in_words(joint + 1 for joint in joints)

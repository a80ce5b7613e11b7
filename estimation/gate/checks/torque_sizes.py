"""Torques with the shape that the description predicts, but another size or sign."""

from __future__ import annotations

from typing import ClassVar

from estimation.gate.check import Check
from estimation.gate.context import Context, Stage
from estimation.gate.finding import Finding
from estimation.gate.quick_fits.joint_physics import described_ratio
from robots.common.plain import two_digits
from robots.robot import Robot

# A torque is reported from this correlation with the described torque on, if their ratio is beyond this factor.
ALIKE, FACTOR = 0.9, 20.0
# Findings after which the torque of a joint is not compared.
EXPLAINED = (
    "torque_sign",
    "negative_friction",
    "moved_by_others",
    "unit_of_torque",
    "position_sign",
    "badly_excited",
    "poorly_explained",
)


class TorqueSizes(Check):
    """Compares torques with those of the robot's description: motor torques, percentages, a wrong sign."""

    name: ClassVar[str] = "torque_sizes"
    stage: ClassVar[Stage] = Stage.FITTED
    order: ClassVar[int] = 60

    def run(self, context: Context) -> list[Finding]:
        """Compares each joint without another finding, if the description has inertias."""
        robot, fitted = context.robot, context.fitted
        if context.cleaned.columns.prefix != "tau" or not robot.has_masses:
            return []
        explained = {finding.joint for finding in context.found(EXPLAINED)}
        findings = []
        for joint, fit in enumerate(fitted.fits):
            compared = None if fit is None or joint + 1 in explained else described_ratio(robot, fit)
            if compared is None:
                continue
            slope, correlation = compared
            if abs(correlation) >= ALIKE and not 1 / FACTOR < slope < FACTOR:
                findings.append(_finding(robot, joint, slope, correlation))
        return findings


def _finding(robot: Robot, joint: int, slope: float, correlation: float) -> Finding:
    gear = float(abs(robot.gear_ratio[joint]))
    if slope < 0:
        guess = "its sign is inverted"
    elif gear > 2 and 0.5 < slope * gear < 2:
        guess = f"it seems to be the motor torque (gear ratio {gear:.4g})"
    else:
        guess = "check its unit (percent of the rated torque, N mm, motor side)"
    return Finding(
        name="torque_sign" if slope < 0 else "unit_of_torque",
        severity="warning",
        text=f"is {two_digits(slope)} times the torque computed from the robot's description (correlation "
        f"{correlation:.2f}): {guess}",
        action="set unit, gear ratio or sign in a mapping (--mapping); ignore this if the robot's description is "
        "inaccurate",
        value=slope,
        column=f"tau{joint + 1}",
        joint=joint + 1,
    )

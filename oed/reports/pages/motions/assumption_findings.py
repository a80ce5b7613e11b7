"""Findings on what a plan assumes of its robot: values without a source, and limits that are not stated."""

from __future__ import annotations

from oed.experiments.safety_checks.margins import missing_limits
from oed.reports.rendering.page import Finding, findings_of
from robots.limits import ACCELERATION_PER_VELOCITY, JERK_PER_ACCELERATION
from robots.robot import Robot

SUBSTITUTES = {
    "acceleration": f"{ACCELERATION_PER_VELOCITY:g}/s times the velocity limit",
    "jerk": f"{JERK_PER_ACCELERATION:g}/s times the acceleration limit",
}


def assumption_findings(robot: Robot) -> tuple[Finding, ...]:
    """Lists what a plan assumes of its robot.

    Args:
        robot: whose motions are planned.
    """
    values = [f"Assumed values without a source: {', '.join(robot.assumed)}."] if robot.assumed else []
    limits = [
        f"The robot's description states no {name} limit for joint {', '.join(map(str, joints))}; assumed: "
        f"{SUBSTITUTES[name]}."
        for name, joints in missing_limits(robot.limits).items()
    ]
    return (*findings_of("value.assumed", values), *findings_of("limit.assumed", limits))

"""The verb `check_log`: checks a log before anything is fitted to it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from estimation.gate.checks import checks_in_order
from estimation.gate.context import Context, Stage
from estimation.gate.finding import Finding
from estimation.gate.report import GateReport, worst_first
from estimation.logs.known_setup import robot_for_log
from estimation.regressions.torque_meanings import as_joint_torque
from robots.common.errors import InputError
from robots.robot import Robot
from robots.signals import Log

# Units are found by several checks; one finding of each kind is enough.
UNITS = ("unit_of_time", "unit_of_position", "motor_side_position")
# Causes, those of them that count as warnings, too, and findings of the fits that they explain.
CAUSES = (
    "coupled_axes",
    "gravity_direction",
    "other_robot",
    "static_poses",
    "swapped_columns",
    "torque_meaning",
    "unit_of_position",
    "unit_of_time",
    "wrapped_angle",
)
FITTED = ("gravity_direction", "other_robot", "swapped_columns")
CONSEQUENCES = (
    "badly_excited",
    "beyond_limits",
    "delay",
    "moved_by_others",
    "negative_friction",
    "poorly_explained",
    "position_sign",
    "too_fast",
    "torque_sign",
    "unit_of_torque",
)
# Causes at single joints, with which the torques fit.
JOINT_CAUSES = ("position_sign", "torque_meaning", "torque_sign")


# Values of 1e300 overflow when they are squared. They are reported, and never fitted.
@np.errstate(over="ignore", invalid="ignore")
def check_log(robot: Robot, log: Log) -> GateReport:
    """Checks sampling, sensors, units, signs, delay and excitation of a log.

    The checks are those of `estimation.gate.CHECKS`. Values and times are checked in every row. Delay, signs and
    excitation come from a quick fit of rigid body and friction, joint by joint, on stretches of some 24,000 rows in
    all: a long log takes little longer.

    Args:
        robot: with n joints; limits, gear ratios and inertias are used if they are known.
        log: of n joints; without torque and current only the motion is checked. Torques of another stated meaning are
            converted first.

    Returns:
        The findings, each with its number, severity, and what to do.

    Raises:
        InputError: a log of another number of joints.
    """
    file = str(log.metadata.get("file", log.name))
    if log.n != robot.n:
        raise InputError(f"{log.n} joints", file=file or None, allowed=f"{robot.n}, as {robot.name} has")
    log = as_joint_torque(robot, log)
    context = Context(robot_for_log(robot, log), log)
    for check in checks_in_order():
        if context.reaches(check.stage):
            context.findings += check().run(context)
    return _report(context, file)


def _report(context: Context, file: str) -> GateReport:
    recorded, robot = context.recorded, context.robot
    fitted = context.fitted if context.reaches(Stage.FITTED) else None
    unknown = np.full(robot.n, np.nan)
    return GateReport(
        robot=robot.name,
        log=file,
        samples=len(recorded.log),
        duration=recorded.original.duration,
        period=recorded.timing.period,
        findings=worst_first(_without_consequences(context, _without_repetitions(context.findings))),
        parts=recorded.parts,
        motion_parts=recorded.motion_parts,
        spikes=recorded.spikes,
        stale=recorded.stale,
        t=recorded.times.t,
        q=recorded.log.q,
        delay=unknown if fitted is None else fitted.delay_values,
        delay_error=unknown if fitted is None else fitted.delay_errors,
        unexplained=unknown if fitted is None else fitted.unexplained,
        information=unknown if fitted is None else fitted.information,
    )


def _without_repetitions(findings: Sequence[Finding]) -> list[Finding]:
    """Keeps the first finding of each unit: of a refused unit, or of the motors' positions at one joint."""
    kept: list[Finding] = []
    known: set[tuple[str, int | None]] = set()
    for finding in findings:
        of_log = finding.severity == "refuse" and finding.name.startswith("unit")
        key = (finding.name, None if of_log else finding.joint)
        if finding.name in UNITS and key in known:
            continue
        known.add(key)
        kept.append(finding)
    return kept


def _without_consequences(context: Context, findings: Sequence[Finding]) -> list[Finding]:
    """Leaves out what a cause explains: its advice would mislead."""
    sure = (finding.severity == "refuse" or finding.name in FITTED for finding in findings if finding.name in CAUSES)
    if any(sure):
        if any(finding.name == "static_poses" for finding in findings):
            return [finding for finding in findings if finding.name == "static_poses"]
        return [finding for finding in findings if finding.name not in CONSEQUENCES]
    if not context.explained or not any(finding.name in JOINT_CAUSES for finding in findings):
        return list(findings)
    follows = [_only_fits_badly(finding, context.explained) for finding in findings]
    # The log is refused for the cause if it was refused for what follows from it.
    refused = any(bad and finding.severity == "refuse" for bad, finding in zip(follows, findings, strict=True))
    return [
        replace(finding, severity="refuse") if refused and finding.name in JOINT_CAUSES else finding
        for bad, finding in zip(follows, findings, strict=True)
        if not bad
    ]


def _only_fits_badly(finding: Finding, explained: frozenset[int]) -> bool:
    """Whether a finding says no more than that explained joints, or all joints together, fit badly."""
    if finding.name == "unit_of_torque":
        return finding.joint is None
    return finding.name in ("badly_excited", "poorly_explained") and finding.joint in explained

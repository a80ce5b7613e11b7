"""The verb `check_log`: checks a log before anything is fitted to it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from estimation.gate.checks import checks_in_order
from estimation.gate.context import Context
from estimation.gate.finding import Finding
from estimation.gate.report import GateReport, worst_first
from estimation.logs.known_setup import robot_for_log
from estimation.regressions.torque_meanings import as_joint_torque
from robots.common.errors import InputError
from robots.robot import Robot
from robots.signals import Log

# Units are found by several checks; one finding of each kind is enough.
UNITS = ("unit_of_time", "unit_of_position", "motor_side_position")
# Other meanings of positions, of one joint or of all, and findings on their range.
MEANINGS = ("coupled_axes", "position_sign", "swapped_columns", "unit_of_position")
RANGES = ("beyond_limits", "too_fast")


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
    fitted = context.logged if context.can_be_fitted else None
    unknown = np.full(robot.n, np.nan)
    return GateReport(
        robot=robot.name,
        log=file,
        samples=len(recorded.log),
        duration=recorded.original.duration,
        period=recorded.timing.period,
        findings=worst_first(_without_repetitions(context.findings)),
        parts=recorded.parts,
        motion_parts=recorded.motion_parts,
        spikes=recorded.spikes,
        stale=recorded.stale,
        t=recorded.times.t,
        q=recorded.log.q,
        updates=recorded.updates,
        delay=unknown if fitted is None else fitted.delay_values,
        delay_error=unknown if fitted is None else fitted.delay_errors,
        unexplained=unknown if fitted is None else fitted.unexplained,
        information=unknown if fitted is None else fitted.information,
    )


def _without_repetitions(findings: Sequence[Finding]) -> list[Finding]:
    """Keeps the first finding of each unit: of a refused unit, or of the motors' positions at one joint.

    What follows from another finding is left out: the pauses between static poses, and the range of positions that mean
    something else.
    """
    if any(finding.name == "static_poses" for finding in findings):
        return [finding for finding in findings if finding.name == "static_poses"]
    meant = {finding.joint for finding in findings if finding.name in MEANINGS}
    if meant:
        findings = [f for f in findings if f.name not in RANGES or not {f.joint, None} & meant]
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

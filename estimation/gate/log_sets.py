"""Checks of several logs that are fitted together."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from estimation.gate.gate import check_log
from estimation.gate.report import GateReport
from robots.robot import Robot
from robots.signals import Log


def check_logs(
    robot: Robot, logs: Sequence[Log], before_each: Callable[[], None] = lambda: None
) -> tuple[GateReport, ...]:
    """Checks logs that are fitted together.

    A log that only rests, or is too short, is left out if others can be fitted. It has no fault, and a campaign has
    such logs.

    Args:
        robot: the robot.
        logs: one or more.
        before_each: is called before each log.

    Returns:
        A report per log. `usable` of one that is left out is empty.

    Raises:
        InputError: a log with a fault, or no log that can be fitted.
    """
    reports = []
    for log in logs:
        before_each()
        report = check_log(robot, log)
        if not report.without_motion:
            report.raise_if_refused()
        reports.append(report)
    if all(report.without_motion for report in reports):
        reports[0].raise_if_refused()
    return tuple(report.left_out() if report.without_motion else report for report in reports)

"""The verb for stored logs: each through the monitor, foreign ones left out and said so."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from estimation.gate import check_log
from estimation.monitoring.findings import Finding
from estimation.monitoring.log_clock import Placed, missing_days, place_logs
from estimation.monitoring.monitor import Monitor
from estimation.monitoring.result import LogRow, MonitorResult
from estimation.monitoring.windows.baseline import Baseline
from estimation.regressions.preparation import torque_of
from estimation.regressions.torque_meanings import as_joint_torque
from robots.common.errors import InputError
from robots.common.progress import SILENT, Progress
from robots.signals import Log


@dataclass
class _Pending:
    """Logs that do not fit, until the next one shows whether the logs or the model are wrong."""

    logs: list[Placed]
    before: Monitor


def monitor_logs(
    monitor: Monitor,
    logs: Sequence[Log],
    *,
    refused: Sequence[LogRow] = (),
    earlier: Sequence[LogRow] = (),
    progress: Progress | None = None,
) -> MonitorResult:
    """Sends logs through a monitor, in the given order.

    A log in which most joints change at its first window does not fit. If a later log fits again, it was of another
    robot, and is left out. If none does, the model does not fit this robot any more.

    Args:
        monitor: new, or with what it has seen before; it is changed.
        logs: with torque or current, in the order in which they were recorded.
        refused: logs that could not be read, for the result.
        earlier: rows of logs that the monitor has seen before, for the result.
        progress: receives the progress.

    Returns:
        Findings, trends, a row per log, and notes.

    Raises:
        InputError: no log could be used.
    """
    bar = progress or SILENT
    bar.start("monitoring", float(max(len(logs), 1)))
    usable, rows = _checked(monitor.baseline, logs)
    placed, notes = place_logs(usable, monitor.last)
    spans: list[tuple[float, float]] = []
    pending: _Pending | None = None
    for number, item in enumerate(placed, start=1):
        bar.update(float(number), item.log.name)
        if pending is not None:
            trial = pending.before.copy()
            new = _send(trial, item)
            if not any(f.kind == "misfit" for f in new):
                rows += [_foreign(monitor.baseline, other.log) for other in pending.logs]
                monitor.take(trial)
                pending = None
                spans.append(_span(item))
                rows.append(_row(item, new))
                continue
        before = monitor.copy() if pending is None else pending.before
        new = _send(monitor, item)
        misfit = any(f.kind == "misfit" and not f.from_start for f in new)
        if misfit and pending is None:
            pending = _Pending([item], before)
        elif pending is not None:
            pending.logs.append(item)
        else:
            rows.append(_row(item, new))
        spans.append(_span(item))
    if pending is not None:
        if len(pending.logs) == 1 and len(placed) > 1:
            # A single log does not show whether it is of another robot. It is left out.
            monitor.take(pending.before)
            rows += [_foreign(monitor.baseline, other.log) for other in pending.logs]
        else:
            rows += [_row(other, ()) for other in pending.logs]
    bar.finish()
    return MonitorResult.of(monitor, (*earlier, *rows, *refused), (*notes, *missing_days(spans)))


def _checked(baseline: Baseline, logs: Sequence[Log]) -> tuple[list[Log], list[LogRow]]:
    """Logs of this robot with joint torques, and a row for each of the others."""
    robot, usable, rows = baseline.robot, [], []
    for log in logs:
        stated = log.metadata.get("robot")
        if log.n != robot.n or (isinstance(stated, str) and stated not in ("", robot.name)):
            what = f"{log.n} joints" if log.n != robot.n else f"the log states robot {stated}"
            rows.append(LogRow.left_out(log.name, f"another robot: {what}, the model is of {robot.name}"))
            continue
        try:
            usable.append(as_joint_torque(robot, log))
        except InputError as error:
            rows.append(LogRow.left_out(log.name, str(error)))
    if not usable:
        first = f": {rows[0].note}" if rows else ""
        raise InputError(f"no log can be used{first}", remedy="give logs of the model's robot")
    return usable, rows


def _send(monitor: Monitor, item: Placed) -> tuple[Finding, ...]:
    log, before = item.log, len(monitor.findings)
    monitor.begin(log.name, payload=log.payload, gravity=log.gravity)
    monitor.update(
        log.t + item.shift,
        log.q,
        torque_of(monitor.baseline.robot, log),
        temperature=log.temperature,
        ambient=log.ambient,
    )
    monitor.finish()
    return monitor.findings[before:]


def _foreign(baseline: Baseline, log: Log) -> LogRow:
    """A row for a log that does not fit, with the reason of the gate where it has one."""
    gate = check_log(baseline.robot, log)
    try:
        gate.raise_if_refused()
    except InputError as error:
        return LogRow.left_out(log.name, str(error))
    return LogRow.left_out(log.name, "does not fit the model: a log of another robot, or a robot after major service")


def _row(item: Placed, found: Sequence[Finding]) -> LogRow:
    start, end = _span(item)
    return LogRow(
        name=item.log.name,
        start=start,
        end=end,
        used=True,
        findings=tuple(f.kind if f.joint is None else f"{f.kind} of joint {f.joint}" for f in found),
    )


def _span(item: Placed) -> tuple[float, float]:
    t = np.asarray(item.log.t)
    return float(t[0]) + item.shift, float(t[-1]) + item.shift

"""The verb for stored logs: each through the monitor, foreign ones left out and said so."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from hashlib import sha256

import numpy as np

from estimation.gate import check_log
from estimation.monitoring.findings import Finding
from estimation.monitoring.log_row import UNFIT, LogRow
from estimation.monitoring.monitor import Monitor
from estimation.monitoring.result import MonitorResult
from estimation.monitoring.stored_logs.log_clock import Placed, missing_days, place_logs
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
    progress: Progress | None = None,
) -> MonitorResult:
    """Sends logs through a monitor, in the given order.

    Logs that the monitor has counted before are not counted again. A log in which most joints change at its first
    window does not fit. If a later log fits again, it was of another robot, and is left out. If none does, the model
    no longer fits this robot.

    Args:
        monitor: new, or with what it has seen before; it is changed.
        logs: with torque or current, in the order in which they were recorded.
        refused: logs that could not be read, for the result.
        progress: receives the progress.

    Returns:
        Findings, trends, a row per log, and notes.

    Raises:
        InputError: no log could be used.
    """
    bar = progress or SILENT
    bar.start("monitoring", float(max(len(logs), 1)))
    usable, rows = _checked(monitor.baseline, logs)
    if not usable and not any(row.used for row in monitor.rows):
        first = f": {rows[0].note}" if rows else ""
        raise InputError(f"no log can be used{first}", remedy="give logs of the model's robot")
    new, notes = _not_counted(monitor, usable)
    placed, remarks = place_logs(new, monitor.last)
    spans: list[tuple[float, float]] = []
    pending: _Pending | None = None
    for number, item in enumerate(placed, start=1):
        bar.update(float(number), item.log.name)
        spans.append(_span(item))
        if pending is not None:
            trial = pending.before.copy()
            found = _send(trial, item)
            if not any(f.kind == "misfit" for f in found):
                rows += [_foreign(monitor.baseline, other.log) for other in pending.logs]
                monitor.take(trial)
                pending = None
                rows.append(_row(item, found))
                continue
        before = monitor.copy() if pending is None else pending.before
        found = _send(monitor, item)
        misfit = [f for f in found if f.kind == "misfit"]
        reason = _refusal(monitor.baseline, item.log) if misfit else ""
        if reason and pending is None:
            monitor.take(before)
            rows.append(LogRow.left_out(item.log.name, reason, _digest(item.log)))
        elif pending is None and any(not f.from_start for f in misfit):
            pending = _Pending([item], before)
        elif pending is not None:
            pending.logs.append(item)
        else:
            rows.append(_row(item, found))
    if pending is not None:
        # A single log does not show whether it is of another robot. It is left out until another one follows.
        name = pending.logs[0].log.name
        followed = len(pending.logs) > 1 or any(row.undecided and row.name != name for row in monitor.rows)
        if not followed:
            monitor.take(pending.before)
            rows += [replace(_foreign(monitor.baseline, other.log), digest="") for other in pending.logs]
        else:
            rows += [_row(other, ()) for other in pending.logs]
    bar.finish()
    again = {row.name for row in (*rows, *refused)}
    monitor.rows = [row for row in monitor.rows if row.used or row.digest or row.name not in again]
    monitor.rows += [*rows, *refused]
    return MonitorResult.of(monitor, [*notes, *remarks, *missing_days(spans)])


def _not_counted(monitor: Monitor, logs: Sequence[Log]) -> tuple[list[Log], list[str]]:
    """Logs that the monitor has not decided on before, and a line on the others."""
    known = {row.digest for row in monitor.rows if row.digest}
    new: list[Log] = []
    before, copies = 0, list[str]()
    seen: dict[str, str] = {}
    for log in logs:
        digest = _digest(log)
        if digest in known:
            before += 1
        elif digest in seen:
            copies.append(f"{log.name or 'A log'} is a copy of {seen[digest] or 'another log'}. It is counted once.")
        else:
            seen[digest] = log.name
            new.append(log)
    notes = (
        [f"{before} of {len(logs)} logs were counted in an earlier run. They are not counted again."] if before else []
    )
    return new, notes + copies


def _digest(log: Log) -> str:
    """By which a log is known again, under any name."""
    found = sha256()
    found.update(np.ascontiguousarray(log.t, dtype=float).tobytes())
    found.update(np.ascontiguousarray(log.q, dtype=float).tobytes())
    if log.tau is not None:
        # Torque constants may be estimated anew in each run: the signs do not depend on them.
        found.update(np.packbits(np.asarray(log.tau) > 0).tobytes())
    return found.hexdigest()


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


def _refusal(baseline: Baseline, log: Log) -> str:
    """Why the gate refuses a log, such as positions in degrees; empty for a log that passes."""
    try:
        check_log(baseline.robot, log).raise_if_refused()
    except InputError as error:
        return str(error)
    return ""


def _foreign(baseline: Baseline, log: Log) -> LogRow:
    """A row for a log that does not fit, with the reason of the gate where it has one."""
    return LogRow.left_out(log.name, _refusal(baseline, log) or UNFIT, _digest(log))


def _row(item: Placed, found: Sequence[Finding]) -> LogRow:
    start, end = _span(item)
    return LogRow(
        name=item.log.name,
        start=start,
        end=end,
        used=True,
        digest=_digest(item.log),
        findings=tuple(f.kind if f.joint is None else f"{f.kind} of joint {f.joint}" for f in found),
    )


def _span(item: Placed) -> tuple[float, float]:
    t = np.asarray(item.log.t)
    return float(t[0]) + item.shift, float(t[-1]) + item.shift

"""Checks of several logs that are fitted together."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from estimation.gate.finding import Finding
from estimation.gate.gate import check_log
from estimation.gate.report import GateReport, worst_first
from robots.common.forks import forked
from robots.robot import Robot
from robots.signals import Log

# Share of a log's rows that another log may have by chance, as at rest or on coarse columns.
REPEATED = 0.3


def check_logs(robot: Robot, logs: Sequence[Log], tolerated: Collection[str] = ()) -> tuple[GateReport, ...]:
    """Checks logs that are fitted together.

    A log that only rests, or is too short, is left out if others can be fitted. It has no fault, and a campaign has
    such logs.

    Args:
        robot: the robot.
        logs: one or more.
        tolerated: names of findings that refuse no log: what is asked of the logs may be their cause.

    Returns:
        A report per log. `usable` of one that is left out is empty.

    Raises:
        InputError: a log with a fault, or no log that can be fitted.
    """
    reports = forked(partial(check_log, robot), logs)
    judged = [report.without(tolerated) for report in reports]
    for report in judged:
        if not report.without_motion:
            report.raise_if_refused()
    if all(report.without_motion for report in judged):
        judged[0].raise_if_refused()
    keys = [_row_keys(log) for log in logs] if len(logs) > 1 else []
    for later, report in enumerate(reports):
        shares = [len(np.intersect1d(keys[later], other)) / max(len(keys[later]), 1) for other in keys[:later]]
        if not report.without_motion and max(shares, default=0.0) > REPEATED:
            earlier = int(np.argmax(shares))
            found = _repeated(logs[earlier], earlier, shares[earlier])
            reports[later] = replace(report, findings=worst_first([*report.findings, found]))
    return tuple(
        report.left_out() if own.without_motion else report for report, own in zip(reports, judged, strict=True)
    )


def _row_keys(log: Log) -> NDArray[np.uint64]:
    """A number for each different row of positions and torques: those at rest are alike in any log, and count once."""
    rows = np.ascontiguousarray(np.hstack([log.q, log.q if log.tau is None else log.tau])).view(np.uint64)
    # Sums of products with odd numbers, modulo 2^64: two rows share one with a chance of 2^-64.
    factors = np.random.default_rng(0).integers(0, 2**63, rows.shape[1], dtype=np.uint64) * np.uint64(2) + np.uint64(1)
    return np.unique(rows @ factors)


def _repeated(other: Log, number: int, share: float) -> Finding:
    return Finding(
        name="same_rows",
        severity="warning",
        text=f"{100 * share:.0f} % of its rows are those of {other.name or f'log {number + 1}'}",
        action="give each recording once: standard errors count these rows twice",
        value=100 * share,
        unit="%",
    )

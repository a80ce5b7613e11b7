"""The first reading of a large log: the gate block by block, segments without a gap, and ranges."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from estimation.gate import GateReport, check_log
from estimation.gate.finding import Finding
from estimation.gate.report import NOT_OF_MOTION, worst_first
from estimation.identifications.identification import usual_speeds
from estimation.logs.parquet_streams import PAUSE, LogStream
from estimation.regressions.preparation import prepare
from estimation.regressions.torque_meanings import as_joint_torque
from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.robot import Robot
from robots.signals import Log

# Rows that the gate checks at a time.
SURVEYED_ROWS = 500_000


@dataclass
class Segment:
    """Rows without a gap.

    Attributes:
        first: row, counted from 0.
        stop: row after the last one.
        start: time of the first row [s].
        end: time of the last row [s].
        period: of the samples [s].
        lower: positions (n,).
        upper: positions (n,).
    """

    first: int
    stop: int
    start: float
    end: float
    period: float
    lower: Array
    upper: Array


@dataclass
class Survey:
    """What one reading of all rows finds.

    Attributes:
        segments: in order.
        dropped: rows that a fit leaves out: outliers and copies.
        reports: of the gate, by block.
        blocks: first rows of the blocks.
        usual: speed of each joint (n,) that it exceeds in a thousandth of a block only.
        lowest: torque (n,) [N m or N].
        highest: torque (n,).
        rows: number of rows.
    """

    segments: list[Segment] = field(default_factory=list)
    dropped: NDArray[np.intp] = field(default_factory=lambda: np.zeros(0, dtype=np.intp))
    reports: list[GateReport] = field(default_factory=list)
    blocks: list[int] = field(default_factory=list)
    usual: Array = field(default_factory=lambda: np.zeros(1))
    lowest: Array = field(default_factory=lambda: np.full(1, np.inf))
    highest: Array = field(default_factory=lambda: np.full(1, -np.inf))
    rows: int = 0
    _mean: Array = field(default_factory=lambda: np.zeros(1))
    _square: Array = field(default_factory=lambda: np.zeros(1))

    @property
    def spread(self) -> Array:
        """Standard deviation of the torque (n,)."""
        return np.sqrt(self._square / max(self.rows, 1))

    def add(self, robot: Robot, log: Log, report: GateReport, first: int) -> None:
        """Adds a block.

        Args:
            robot: the robot.
            log: rows of the block, with joint torque.
            report: of the gate on it.
            first: row of the log at which it begins.
        """
        self.blocks.append(first)
        self.reports.append(replace(report, t=np.zeros(0), q=np.zeros((0, log.n))))
        out = np.union1d(report.spikes, report.stale).astype(np.intp)
        self.dropped = np.concatenate([self.dropped, out + first])
        for part in report.usable(log):
            ready = prepare(robot, part)
            self.usual = np.maximum(self.usual, usual_speeds([ready]))
            self.lowest = np.minimum(self.lowest, ready.tau.min(axis=0))
            self.highest = np.maximum(self.highest, ready.tau.max(axis=0))
            self._add_torque(ready.tau)
            begin, end = np.searchsorted(log.t, [part.t[0], part.t[-1]])
            period = ready.positions.period
            self._add_segment(
                Segment(
                    first=first + int(begin),
                    stop=first + int(end) + 1,
                    start=float(part.t[0]),
                    end=float(part.t[-1]),
                    period=period,
                    lower=part.q.min(axis=0),
                    upper=part.q.max(axis=0),
                )
            )

    def _add_torque(self, tau: Array) -> None:
        """Pools mean and squares (Chan, Golub and LeVeque 1983)."""
        count, mean = len(tau), tau.mean(axis=0)
        total, off = self.rows + count, mean - self._mean
        self._square = self._square + ((tau - mean) ** 2).sum(axis=0) + off**2 * self.rows * count / total
        self._mean = self._mean + off * count / total
        self.rows = total

    def _add_segment(self, new: Segment) -> None:
        last = self.segments[-1] if self.segments else None
        if last is None or last.stop != new.first or new.start - last.end > PAUSE * new.period:
            self.segments.append(new)
            return
        steps = last.stop - last.first - 1, new.stop - new.first
        last.period = float(np.average([last.period, new.period], weights=steps))
        last.stop, last.end = new.stop, new.end
        last.lower, last.upper = np.minimum(last.lower, new.lower), np.maximum(last.upper, new.upper)


def survey(robot: Robot, stream: LogStream, advance: Callable[[int, str], None]) -> Survey:
    """Reads and checks all rows once.

    Args:
        robot: the robot.
        stream: the log.
        advance: receives the number of rows that were read, and a note.

    Raises:
        InputError: a block whose times or angles the gate would correct, which a log in pieces does not allow.
    """
    found = Survey()
    for start, end in stream.runs():
        bounds = np.linspace(start, end, max(1, -(-(end - start) // SURVEYED_ROWS)) + 1).astype(int).tolist()
        for first, stop in pairwise(bounds):
            log = as_joint_torque(robot, stream.rows(first, stop), stream.torque_is, estimate=False)
            report = check_log(robot, log)
            for name, same in (("t", np.array_equal(report.t, log.t)), ("q1", np.array_equal(report.q, log.q))):
                if not same:
                    part, inside = stream.place(first)
                    raise InputError(
                        "late time stamps" if name == "t" else "wrapped angles",
                        file=part.path,
                        column=name,
                        row=inside + 1,
                        allowed="times and angles that need no correction, in a log that is read in pieces",
                        remedy="identify this part alone, without --stream, or correct the file",
                    )
            found.add(robot, log, report, first)
            advance(stop - first, "checking the log")
    return found


def merged_report(found: Survey, stream: LogStream) -> GateReport:
    """Joins the blocks' reports.

    A finding that refuses a block refuses the log if it names a row, or if half of the blocks have it; one that says
    that the motion is too small, if all have it. Else it becomes a warning.
    """
    total = len(found.reports)
    kept: dict[tuple[object, ...], tuple[Finding, list[int]]] = {}
    for block, report in enumerate(found.reports):
        for finding in report.findings:
            key = (finding.name, finding.joint, finding.column, finding.severity)
            kept.setdefault(key, (finding, []))[1].append(block)
    findings = []
    for finding, blocks in kept.values():
        part, inside = stream.place(found.blocks[blocks[0]])
        severity = finding.severity
        needed = total if finding.name in NOT_OF_MOTION else total / 2
        if severity == "refuse" and finding.row is None and len(blocks) < needed:
            severity = "warning"
        where = f" (in {len(blocks)} of {total} blocks, first in {part.path.name} from row {inside + 1})"
        row = None if finding.row is None else stream.place(found.blocks[blocks[0]] + finding.row - 1)[1] + 1
        findings.append(replace(finding, severity=severity, row=row, text=finding.text + (where if total > 1 else "")))
    first = found.reports[0]
    return replace(
        first,
        log=str(stream.path),
        samples=len(stream),
        duration=stream.parts[-1].end - stream.parts[0].start,
        findings=worst_first(findings),
        parts=tuple((part.first, part.stop) for part in found.segments),
        motion_parts=tuple((part.first, part.stop) for part in found.segments),
        spikes=found.dropped,
        stale=np.zeros(0, dtype=np.intp),
        delay=_median([report.delay for report in found.reports]),
        delay_error=_median([report.delay_error for report in found.reports]),
        unexplained=_median([report.unexplained for report in found.reports]),
        information=_median([report.information for report in found.reports]),
    )


def _median(values: Sequence[Array]) -> Array:
    """Median (n,) of the known values; NaN where none is known."""
    columns = [column[np.isfinite(column)] for column in np.array(values).T]
    return np.array([np.median(column) if len(column) else np.nan for column in columns])

"""Result of the checks of a log."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from estimation.gate.finding import SEVERITIES, Finding, Severity
from estimation.logs.torque_source import NO_TORQUE
from estimation.recordings.rows.held_values import between_updates
from estimation.recordings.rows.outliers import interpolated
from estimation.recordings.rows.timing import FEWEST
from robots.common.arrays import Array
from robots.common.errors import InputError, NotIdentifiableError
from robots.common.records import Finding as Remark
from robots.common.records import Result
from robots.signals import Log

if TYPE_CHECKING:
    import pandas as pd


# Findings that do not concern a prediction, and findings on torques, which only make its error wrong.
NOT_OF_MOTION = frozenset(
    {"badly_excited", "hardly_moves", "no_motion", NO_TORQUE, "poorly_explained", "short", "undetermined"}
)
OF_TORQUE = frozenset(
    {
        "constant_torque",
        "moved_by_others",
        "negative_friction",
        "nominal_error",
        "static_poses",
        "torque_meaning",
        "torque_sign",
        "unit_of_torque",
    }
)
# Findings on a log without a fault that rests, or is too short, so that others are fitted without it.
NO_MOTION = frozenset({"no_motion", "short", "static_poses"})
# Findings on a log without a fault whose motion does not determine the parameters.
NO_INFORMATION = frozenset({"badly_excited"})


@dataclass(frozen=True, kw_only=True, eq=False)
class GateReport(Result):
    """The findings on one log.

    Attributes:
        robot: name of the robot.
        log: name of the log, or its file.
        samples: rows of the log.
        duration: [s].
        period: median sample period [s].
        findings: the worst first.
        parts: (first, stop) indices of the parts without a gap and without a column that hung. Nothing is interpolated
            between them.
        motion_parts: the same, with the rows in which a torque or current hung.
        spikes: indices (K,) of rows with isolated outliers, which a fit leaves out.
        stale: indices (K,) of rows with wrong times, which a fit leaves out: copies of the row before, and rows
            that were written late by an unknown time.
        t: times of the rows (N,) [s], corrected for rows that were written late, if possible.
        q: positions (N, n) [rad or m], with unwrapped angles.
        updates: rows (K,) in which the torques are updated, where others repeat them; they are interpolated between.
        delay: by which the torque lags the position (n,) [s], NaN if the log does not determine it.
        delay_error: its standard error (n,) [s].
        unexplained: held-out torque error over the torque's standard deviation (n,), from a quick fit of rigid body
            and friction; NaN without torque.
        information: inertia or friction power of each joint over its standard error, the larger of the two (n,);
            NaN without torque.
    """

    ENTRIES = (
        "robot",
        "log",
        "refused",
        "samples",
        "duration",
        "period",
        "spikes=spike_rows",
        "stale=stale_rows",
        "parts",
        "delay",
        "delay_error",
        "unexplained",
        "information",
        "findings",
    )

    robot: str
    log: str
    samples: int
    duration: float
    period: float
    findings: tuple[Finding, ...]
    parts: tuple[tuple[int, int], ...]
    motion_parts: tuple[tuple[int, int], ...]
    spikes: NDArray[np.intp]
    stale: NDArray[np.intp]
    t: Array
    q: Array
    updates: NDArray[np.intp]
    delay: Array
    delay_error: Array
    unexplained: Array
    information: Array

    @property
    def refused(self) -> bool:
        """Whether the log must not be fitted."""
        return any(finding.severity == "refuse" for finding in self.findings)

    @property
    def success(self) -> bool:
        """Whether the log may be fitted."""
        return not self.refused

    @property
    def without_motion(self) -> bool:
        """Whether the log is refused only because it rests, or is too short."""
        return self.refused and all(finding.name in NO_MOTION for finding in self.of("refuse"))

    def of(self, severity: Severity) -> tuple[Finding, ...]:
        """Gives the findings of one severity."""
        return tuple(finding for finding in self.findings if finding.severity == severity)

    def raise_if_refused(self) -> None:
        """Refuses the log with its first reason and the number of the others.

        Raises:
            NotIdentifiableError: the only fault is that the motion does not explain any joint's torque.
            InputError: any other fault with which the fit would be wrong.
        """
        reasons = self.of("refuse")
        if not reasons:
            return
        first = reasons[0]
        more = f" (and {len(reasons) - 1} more: {', '.join(_names(reasons[1:]))})" if len(reasons) > 1 else ""
        kind = NotIdentifiableError if all(reason.name in NO_INFORMATION for reason in reasons) else InputError
        raise kind(
            f"{first.text}{more}",
            file=self.log or None,
            column=first.column,
            row=first.row,
            joint=first.joint,
            remedy=first.action,
        )

    def usable(self, log: Log, *, interpolate: Collection[str] = (), shortest: float = 0.0) -> tuple[Log, ...]:
        """Repairs the log and splits it at its gaps.

        Rows with wrong times are left out, and so are rows with outliers where these are not interpolated.

        Args:
            log: the log that was checked.
            interpolate: the columns whose outliers are interpolated: of ``q``, ``tau`` and ``current``.
            shortest: duration [s] of the shortest part that is of use.

        Returns:
            Its parts of 20 samples or more; the log itself if it has no fault; nothing if the log is left out.

        Raises:
            InputError: another log, or nothing is left.
        """
        if len(log) != self.samples:
            raise InputError(f"{len(log)} rows", allowed=f"{self.samples} rows, as in the checked log")
        if not self.parts:
            return ()
        log = self.corrected(log)
        if interpolate and len(self.spikes):
            log = interpolated(log, interpolate)
        kept = np.ones(len(log), dtype=bool)
        kept[self.stale] = False
        kept[self.spikes] &= bool(interpolate)
        if self.parts == ((0, len(log)),) and kept.all():
            return (log,)
        parts = [np.arange(first, stop)[kept[first:stop]] for first, stop in self.parts]
        long = [part for part in parts if len(part) >= FEWEST and log.t[part[-1]] - log.t[part[0]] >= shortest]
        logs = tuple(log.rows(part) for part in long)
        if not logs:
            raise InputError("no part of the log is long enough", file=self.log or None, allowed=f"{FEWEST} rows")
        return logs

    def corrected(self, log: Log) -> Log:
        """Gives the checked log with corrected times, unwrapped angles, and torques between their updates."""
        same_times, same_angles = np.array_equal(self.t, log.t), np.array_equal(self.q, log.q)
        if not same_times or not same_angles:
            log = replace(log, t=log.t if same_times else self.t, q=log.q if same_angles else self.q)
        return between_updates(log, self.updates)

    def without(self, names: Collection[str]) -> GateReport:
        """Gives the report without findings of some names."""
        return replace(self, findings=tuple(finding for finding in self.findings if finding.name not in names))

    def left_out(self) -> GateReport:
        """Gives the report for a log that is left out of a fit to several logs: nothing is refused or usable."""
        findings = [
            replace(finding, severity="warning", text=f"{finding.text}: this log is left out")
            if finding.severity == "refuse"
            else finding
            for finding in self.findings
        ]
        return replace(self, findings=worst_first(findings), parts=())

    def for_motion(self) -> GateReport:
        """Gives the report for a log of which only the motion is used: findings on torques are warnings at most."""
        kept = self.without(NOT_OF_MOTION).findings
        mild = [
            replace(finding, severity="warning")
            if finding.severity == "refuse" and (finding.name in OF_TORQUE or _is_of_torque(finding))
            else finding
            for finding in kept
        ]
        return replace(self, findings=worst_first(mild), parts=self.motion_parts)

    @property
    def spike_rows(self) -> NDArray[np.intp]:
        """Rows (K,) with a spike, counted from 1."""
        return self.spikes + 1

    @property
    def stale_rows(self) -> NDArray[np.intp]:
        """Rows (K,) that repeat the one before, counted from 1."""
        return self.stale + 1

    @property
    def verdict(self) -> str:
        """What the log can be used for, in words."""
        if self.refused:
            return "refused"
        lacks_torque = any(finding.name == NO_TORQUE for finding in self.findings)
        return "no torque, its motion is usable" if lacks_torque else "usable"

    @property
    def conclusion(self) -> str:
        """Whether the log is usable, and what to do first."""
        worst = f" First: {self.findings[0].action}." if self.refused else ""
        return f"{self.log or 'log'}: {self.verdict}.{worst}"

    @property
    def remarks(self) -> tuple[Remark, ...]:
        """The findings, the worst first."""
        return tuple(finding.remark() for finding in self.findings)

    def summary(self) -> str:
        """Gives the verdict and lists the findings, the worst first."""
        rate = 1.0 / self.period if self.period > 0 else float("nan")
        head = f"{self.log or 'log'}: {self.verdict}; {self.samples} samples, {self.duration:.4g} s at {rate:.4g} Hz"
        rows = (f"  {finding.severity} {finding.code or ''}".rstrip() + f": {finding}" for finding in self.findings)
        return "\n".join([head, *rows])

    def to_frame(self) -> pd.DataFrame:
        """Tabulates the findings, one a row."""
        import pandas as pd

        return pd.DataFrame(list(self.findings), columns=list(Finding.__annotations__))


def worst_first(findings: list[Finding]) -> tuple[Finding, ...]:
    """Sorts findings by severity, the worst first, and keeps the order among equals."""
    return tuple(sorted(findings, key=lambda finding: -SEVERITIES.index(finding.severity)))


def _is_of_torque(finding: Finding) -> bool:
    return finding.column is not None and finding.column.startswith(("tau", "i"))


def _names(findings: tuple[Finding, ...]) -> list[str]:
    return list(dict.fromkeys(finding.name for finding in findings))

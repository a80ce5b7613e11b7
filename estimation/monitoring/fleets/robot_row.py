"""One robot of a fleet: its light, its findings, and its trend, as they are kept in a file."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from estimation.monitoring.findings import Finding, when
from estimation.monitoring.log_row import LogRow
from estimation.monitoring.result import MonitorResult
from robots.common.records import Record

LIGHTS = ("red", "amber", "grey", "green")
"""From the worst to the best; grey is a robot without a log that can be used."""


@dataclass(frozen=True, kw_only=True)
class Trend:
    """Course of a robot's friction, thinned.

    Attributes:
        hours: since its first log (k,) [h].
        heat: change that temperature explains, per joint (n, k) [%].
        rest: change that it does not explain, per joint (n, k) [%]; None where it is unknown.
        logs: the log behind each point (k,).
    """

    hours: tuple[float, ...] = ()
    heat: tuple[tuple[float | None, ...], ...] = ()
    rest: tuple[tuple[float | None, ...], ...] = ()
    logs: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class RobotRow(Record, shares=("origin",)):
    """One robot.

    Attributes:
        name: of the robot.
        light: red, amber, green, or grey without a usable log.
        text: what was found, or why nothing could be.
        advice: what to do.
        since: date of the worst finding, in words.
        logs: a row per log.
        findings: all of them.
        notes: on the clocks of its logs.
        hours: recorded motion [h].
        origin: start of its first log [s].
        heat: lowest and highest change of friction by temperature [%].
        trend: for the picture.
    """

    ENTRIES = (
        "robot=name",
        "light",
        "text",
        "advice",
        "since",
        "hours",
        "heat_percent=heat",
        "findings",
        "logs",
        "notes",
    )

    name: str
    light: str
    text: str
    advice: str = ""
    since: str = ""
    logs: tuple[LogRow, ...] = ()
    findings: tuple[Finding, ...] = ()
    notes: tuple[str, ...] = ()
    hours: float = 0.0
    origin: float = 0.0
    heat: tuple[float, float] = (0.0, 0.0)
    trend: Trend = field(default_factory=Trend)

    @classmethod
    def of(cls, name: str, result: MonitorResult) -> RobotRow:
        """Makes the row of a robot that was monitored."""
        worst = result.headline
        return cls(
            name=name,
            light=result.light,
            text=result.sentence(),
            advice=result.advice(),
            since=when(worst.earliest, result.origin) if worst else "",
            logs=result.logs,
            findings=result.findings,
            notes=result.notes,
            hours=result.hours,
            origin=result.origin,
            heat=result.heat_range,
            trend=_trend(result),
        )

    @classmethod
    def failed(cls, name: str, reason: str, logs: tuple[LogRow, ...] = ()) -> RobotRow:
        """Makes the row of a robot without a usable log."""
        return cls(name=name, light="grey", text=reason, advice="Check its logs with oed check.", logs=logs)

    @property
    def order(self) -> tuple[int, float, str]:
        """Sorts rows, worst first."""
        strongest = max((f.sigmas for f in self.findings if f.severity != "info"), default=0.0)
        return LIGHTS.index(self.light), -strongest, self.name

    @property
    def left_out(self) -> int:
        """Number of logs that were left out."""
        return sum(not row.used for row in self.logs)


def _trend(result: MonitorResult) -> Trend:
    h = result.history
    count = len(h["start"])
    # Points of a trend that are kept of each robot.
    chosen = np.unique(np.linspace(0, count - 1, min(240, count)).round().astype(int))
    names = [row.name for row in result.logs if row.used]

    def percent(values: Any) -> tuple[tuple[float | None, ...], ...]:
        return tuple(
            tuple(None if np.isnan(v) else round(float(100 * np.expm1(v)), 2) for v in column)
            for column in values[chosen].T
        )

    return Trend(
        hours=tuple(np.round((h["start"][chosen] - result.origin) / 3600, 4).tolist()),
        heat=percent(h["heat"]),
        rest=percent(h["rest"]),
        logs=tuple(names[int(k)] if int(k) < len(names) else "" for k in h["log"][chosen]),
    )

"""The page of a monitor."""

from __future__ import annotations

import numpy as np

from estimation.monitoring import MonitorResult
from estimation.monitoring.findings import LIGHTS
from estimation.monitoring.result import HEAT_WORDS
from oed.reports.pictures.monitor_pictures import trend_picture
from oed.reports.rendering.page import Cell, Fact, Page, Section, Status, Table, page_of, table_of
from oed.reports.rendering.picture import Picture
from oed.reports.rendering.provenance import Recording

STATUS: dict[str, Status] = {"green": "good", "amber": "note", "red": "act"}
ROLES = {"green": "good", "amber": "warning", "red": "bad"}


def monitor_page(result: MonitorResult) -> Page:
    """Builds the page: findings, trends of all joints, and the logs."""
    low, high = result.heat_range
    left_out = [row for row in result.logs if not row.used]
    return page_of(
        result,
        title="Monitoring",
        robot=result.robot,
        logs=tuple(
            Recording(name=row.name, start=row.start, duration=row.end - row.start) for row in result.logs if row.used
        ),
        facts=(
            Fact(label="Light", value=result.light, status=STATUS[result.light]),
            Fact(label="Findings", value=len(result.findings)),
            Fact(label="Logs", value=len(result.logs) - len(left_out), note=f"{len(left_out)} left out"),
            Fact(label="Motion", value=f"{result.hours:.2g} h"),
            Fact(
                label="Friction by temperature",
                value=f"{low:+.0f} to {high:+.0f} %",
                note=f"from {HEAT_WORDS[result.heat]}",
            ),
            Fact(label="False alarms", value=f"one in {result.false_alarm_hours:g} h of motion"),
        ),
        sections=(
            Section(
                title="Findings",
                paragraphs=(
                    "A change is reported where a CUSUM or EWMA chart exceeds its threshold and a fit of a step "
                    "confirms it. Sizes and dates have 95 % intervals.",
                )
                if result.findings
                else ("No chart gave an alarm.",),
                tables=(findings_table(result),) if result.findings else (),
            ),
            Section(title="Trends", pictures=(trends(result),)),
            Section(title="Logs", tables=(_logs(result),), folded=len(result.logs) > 40),
            *_change_points(result),
        ),
    )


def findings_table(result: MonitorResult) -> Table:
    """A row per finding."""
    return table_of(
        result.findings,
        {
            "light": lambda f: LIGHTS[f.severity],
            "kind": lambda f: f.kind,
            "joint": lambda f: f.joint,
            "size": lambda f: f"{f.size:+.3g} {f.unit}".rstrip() if f.unit else None,
            "95 %": lambda f: f"{f.low:+.3g} to {f.high:+.3g}" if f.unit else None,
            "since": lambda f: f.date(result.origin),
            "log": lambda f: f.log or None,
        },
    )


def trends(result: MonitorResult, name: str = "trends") -> Picture:
    """The picture of the trends."""
    h = result.history
    names = [row.name for row in result.logs if row.used]
    marks = tuple(
        (
            f.joint,
            (f.earliest - result.origin) / 3600,
            (f.latest - result.origin) / 3600,
            f.kind.replace("_", " "),
            ROLES[LIGHTS[f.severity]],
        )
        for f in result.findings
    )
    return trend_picture(
        (h["start"] - result.origin) / 3600,
        h["friction"],
        h["heat"],
        h["rest"],
        h["error"],
        joint_names=result.joint_names,
        logs=[names[int(k)] if 0 <= int(k) < len(names) else "" for k in h["log"]],
        marks=marks,
        name=name,
    )


def _logs(result: MonitorResult) -> Table:
    return table_of(
        result.logs,
        {
            "log": lambda row: row.name,
            "start": lambda row: result.since(row.start) if np.isfinite(row.start) else None,
            "": lambda row: "used" if row.used else "left out",
            "findings": lambda row: ", ".join(row.findings) or row.note or None,
        },
    )


def _change_points(result: MonitorResult) -> tuple[Section, ...]:
    if result.change_points is None:
        return ()
    rows: tuple[tuple[Cell, ...], ...] = tuple(
        (point.joint, result.since(point.time), f"{point.percent:+.3g} %") for point in result.change_points
    )
    return (
        Section(
            title="Change points of the stored logs",
            paragraphs=(
                "A second method for comparison: PELT on the friction that temperature does not explain, over all logs "
                "at once. It takes no account of model errors, and finds more than the charts.",
            ),
            tables=(Table(headings=("joint", "time", "change"), rows=rows),) if rows else (),
            folded=True,
        ),
    )

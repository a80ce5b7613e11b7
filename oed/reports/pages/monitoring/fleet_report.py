"""The page of a fleet: what a manager reads in a minute."""

from __future__ import annotations

import numpy as np

from estimation.monitoring.fleets import FleetResult, RobotRow
from oed.reports.rendering.page import Fact, Page, Section, Status, Table, page_of, table_of
from oed.reports.rendering.palette import joint_role
from oed.reports.rendering.picture import Line, Panel, Picture, Series

# Robots whose trends are drawn; the table lists all.
DRAWN = 12


def fleet_page(result: FleetResult) -> Page:
    """Builds the page: lights, the table of robots, the trends of the worst, and logs that were left out."""
    left_out = tuple((row.name, log.name, log.note) for row in result.rows for log in row.logs if not log.used)
    drawn = [row for row in result.rows if row.trend.hours][:DRAWN]
    return page_of(
        result,
        title="Fleet",
        facts=(
            _count(result, "red", "need action", "act"),
            _count(result, "amber", "to be watched", "note"),
            _count(result, "green", "no finding"),
            _count(result, "grey", "no usable log"),
            Fact(label="Logs", value=sum(len(row.logs) for row in result.rows), note=f"{len(left_out)} left out"),
        ),
        sections=(
            Section(title="Robots, worst first", tables=(_robots(result),)),
            *(
                (
                    Section(
                        title="Trends",
                        paragraphs=(
                            "Change of each joint's friction against the model. On the left what temperature does not "
                            "explain, on the right what it explains. Each point is a window of a log; hovering shows "
                            "the log.",
                        ),
                        pictures=(trends_picture(drawn),),
                    ),
                )
                if drawn
                else ()
            ),
            *(
                (
                    Section(
                        title="Logs that were left out",
                        tables=(Table(headings=("robot", "log", "reason"), rows=left_out),),
                        folded=True,
                    ),
                )
                if left_out
                else ()
            ),
        ),
    )


def _count(result: FleetResult, light: str, note: str, status: Status = "neutral") -> Fact:
    count = result.count(light)
    return Fact(label=light.capitalize(), value=count, note=note, status=status if count else "neutral")


def _robots(result: FleetResult) -> Table:
    return table_of(
        result.rows,
        {
            "light": lambda row: row.light,
            "robot": lambda row: row.name,
            "since": lambda row: row.since or None,
            "logs used": lambda row: f"{len(row.logs) - row.left_out} of {len(row.logs)}",
            "by temperature": lambda row: f"{row.heat[0]:+.0f} to {row.heat[1]:+.0f} %" if row.trend.hours else None,
        },
    )


def trends_picture(rows: list[RobotRow]) -> Picture:
    """Draws two panels per robot: friction that temperature does not explain, and that it explains."""
    panels = []
    for row in rows:
        days = np.asarray(row.trend.hours) / 24.0
        for title, columns in (("not explained", row.trend.rest), ("by temperature", row.trend.heat)):
            panels.append(
                Panel(
                    title=f"{row.name} ({row.light}): {title}",
                    x_label="time [days]",
                    y_label="change of friction [%]",
                    lines=(Line(value=0.0, role="neutral", dash="dot"),),
                    series=tuple(
                        Series(
                            x=days,
                            y=np.array([np.nan if v is None else v for v in column]),
                            name=f"joint {j}",
                            kind="markers",
                            role=joint_role(j),
                            texts=row.trend.logs,
                        )
                        for j, column in enumerate(columns, start=1)
                    ),
                )
            )
    return Picture(
        title="Friction of the worst robots", name="fleet_trends", panels=tuple(panels), columns=2, panel_height=190
    )

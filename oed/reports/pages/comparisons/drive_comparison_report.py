"""The page of drives of several runs against each other."""

from __future__ import annotations

import numpy as np

from estimation.comparisons import DriveComparison
from estimation.uncertainty.quantiles import NORMAL_95
from oed.reports.rendering.page import Fact, Page, Section, Table, page_of
from oed.reports.rendering.palette import sequence_role
from oed.reports.rendering.picture import Panel, Picture, Series
from robots.common.plain import percent, significant


def drive_comparison_page(comparison: DriveComparison) -> Page:
    """Builds the page: the parameters of all runs with intervals, what all joints share, and what single ones do."""
    runs = comparison.runs
    shared = tuple(
        (c.parameter, runs[c.run].label, percent(c.change), f"{percent(c.lower)} to {percent(c.upper)}", c.cause)
        for c in comparison.shared
    )
    rows = tuple(
        (
            item.name,
            *(significant(value, error) for value, error in zip(item.values, item.errors, strict=True)),
            item.unit,
            significant(item.common, item.common_error),
            f"{item.adjusted:.2g}",
            "differs" if item.differs else "",
        )
        for item in comparison.differences
    )
    tables = [
        Table(
            headings=("parameter", *(run.label for run in runs), "unit", "common", "adjusted p", ""),
            rows=rows,
            caption=f"Standard errors are {comparison.spread:.2g} times those of the runs, because the runs scatter.",
        )
    ]
    if shared:
        headings = ("parameter", "run", "change of all joints", "95 % interval", "usual causes")
        tables.insert(0, Table(headings=headings, rows=shared))
    return page_of(
        comparison,
        title="Comparison of drives",
        robot=comparison.robot,
        facts=(
            Fact(label="Runs", value=len(runs)),
            Fact(label="Parameters that differ", value=len(comparison.different)),
            Fact(label="Changes of all joints", value=len(comparison.shared)),
        ),
        sections=(
            Section(title="Parameters", pictures=_pictures(comparison), tables=tuple(tables)),
            Section(
                title="Runs",
                tables=(
                    Table(
                        headings=("run", "held-out error [mrad]", "joints [degC]", "effects"),
                        rows=tuple(
                            (
                                run.label,
                                f"{1e3 * run.error:.3g}",
                                f"{run.temperature:.1f}" if np.isfinite(run.temperature) else "",
                                ", ".join(run.effects),
                            )
                            for run in runs
                        ),
                    ),
                ),
            ),
        ),
    )


def _pictures(comparison: DriveComparison) -> tuple[Picture, ...]:
    """One panel a kind of parameter: the values of all joints and runs with 95 % intervals."""
    pictures = []
    for parameter in dict.fromkeys(item.parameter for item in comparison.differences):
        own = [item for item in comparison.differences if item.parameter == parameter]
        place = np.arange(len(own), dtype=float)
        count = len(comparison.runs)
        series = tuple(
            Series(
                x=place + 0.6 * ((k + 0.5) / count - 0.5),
                y=np.array([item.values[k] for item in own]),
                error=NORMAL_95 * np.array([item.errors[k] for item in own]),
                name=run.label,
                kind="markers",
                role=sequence_role(k),
            )
            for k, run in enumerate(comparison.runs)
        )
        panel = Panel(
            y_label=f"{parameter} [{own[0].unit}]", categories=tuple(item.group for item in own), series=series
        )
        name = f"drive_comparison_{parameter}"
        pictures.append(Picture(title=parameter.replace("_", " "), name=name, panels=(panel,), panel_height=220))
    return tuple(pictures)

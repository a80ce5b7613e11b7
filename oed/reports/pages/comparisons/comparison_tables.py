"""Tables of the page of a comparison."""

from __future__ import annotations

import numpy as np

from estimation.comparisons import ModelComparison
from oed.reports.rendering.page import Cell, Table, table_of
from robots.common.plain import significant, significant_error


def runs_table(comparison: ModelComparison) -> Table:
    """Lists the runs with dates and temperatures."""
    rows: list[tuple[Cell, ...]] = []
    for k, run in enumerate(comparison.runs):
        warm = None if run.temperature is None else float(np.nanmean(run.temperature))
        hours = None if comparison.hours is None else float(comparison.hours[k])
        rows.append((run.label, run.date_text or "–", hours, warm, run.file or "–"))
    return Table(headings=("run", "date (UTC)", "time [h]", "joints [degC]", "file"), rows=tuple(rows))


def whole_table(comparison: ModelComparison) -> Table:
    """Lists the tests of the whole model."""
    return table_of(
        (item for item in comparison.differences if item.level == "whole"),
        {
            "run": lambda item: "all together" if item.run is None else comparison.labels[item.run],
            "chi-square": lambda item: item.statistic,
            "degrees of freedom": lambda item: item.dof,
            "adjusted p": lambda item: f"{item.adjusted:.2g}",
            "significant": lambda item: item.significant(comparison.alpha),
        },
        caption=f"Whole model against {comparison.labels[0]}.",
    )


def parts_table(comparison: ModelComparison) -> Table:
    """Lists the adjusted p-values of each part, run by run."""
    names = dict.fromkeys(item.name for item in comparison.differences if item.level == "part")
    runs = range(1, len(comparison.runs))
    found = {(i.name, i.run): i for i in comparison.differences if i.level == "part"}
    rows: list[tuple[Cell, ...]] = []
    for name in names:
        cells = [found[name, run] for run in runs]
        rows.append((name, *(f"{i.adjusted:.2g}{' *' if i.adjusted < comparison.alpha else ''}" for i in cells)))
    return Table(
        headings=("part", *comparison.labels[1:]),
        rows=tuple(rows),
        caption=f"Adjusted p-values of each part against {comparison.labels[0]}. * is significant.",
    )


def parameters_table(comparison: ModelComparison) -> Table:
    """Lists the parameters of the first and the last run, with their difference."""
    last = len(comparison.runs) - 1
    rows: list[tuple[Cell, ...]] = []
    compared = comparison.tested
    index = {column.name: i for i, column in enumerate(compared.columns)}
    for item in comparison.of_run(last, "parameter"):
        i = index[item.name]
        values = [
            significant(float(compared.values[k, i]), float(np.sqrt(compared.covariances[k, i, i]))) for k in (0, last)
        ]
        percent = "–" if not np.isfinite(item.percent) else f"{item.percent:+.2f}"
        verdict = "yes" if item.adjusted < comparison.alpha else "no"
        change = significant(item.change, item.error)
        rows.append(
            (
                item.name,
                *values,
                change,
                significant_error(item.error),
                percent,
                item.unit,
                f"{item.adjusted:.2g}",
                verdict,
            )
        )
    return Table(
        headings=(
            "parameter",
            comparison.labels[0],
            comparison.labels[last],
            "difference",
            "standard error",
            "difference [%]",
            "unit",
            "adjusted p",
            "significant",
        ),
        rows=tuple(rows),
        caption="Parameters that all runs determine"
        + (", without the payload of a run that carries one." if comparison.payloads else "."),
        align=("left", *["right"] * 5, "left", "right", "left"),
    )


def drift_table(comparison: ModelComparison) -> Table:
    """Lists trend and settling of each quantity."""
    labels, per = comparison.labels, "hour" if comparison.hours is not None else "run"
    return table_of(
        comparison.drifts,
        {
            "quantity": lambda item: item.name,
            f"trend per {per}": lambda item: significant(item.slope, item.slope_error),
            "standard error": lambda item: significant_error(item.slope_error),
            "unit": lambda item: item.unit,
            "adjusted p": lambda item: f"{item.adjusted:.2g}",
            "settled from": lambda item: "not settled" if item.settled is None else labels[item.settled],
            "first [%]": lambda item: f"{item.percent:+.2f}",
        },
        caption="Settled: from this run on all stay within the noise of the last third. First: distance from its mean.",
    )


def merged_table(comparison: ModelComparison) -> Table:
    """Lists the merged parameters."""
    model = comparison.merged.model
    rows: list[tuple[Cell, ...]] = [
        (c.name, significant(float(v), float(e)), significant_error(float(e)), significant_error(float(s)), c.unit)
        for c, v, e, s, known in zip(
            model.parameters,
            model.values,
            model.standard_errors,
            comparison.merged.scatter,
            model.determined,
            strict=True,
        )
        if known
    ]
    return Table(headings=("parameter", "value", "standard error", "scatter between runs", "unit"), rows=tuple(rows))

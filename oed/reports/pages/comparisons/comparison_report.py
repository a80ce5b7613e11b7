"""The page of a comparison of models."""

from __future__ import annotations

import numpy as np

from estimation.comparisons import ModelComparison
from estimation.comparisons.friction_changes import interval_of, percent_of
from estimation.uncertainty.quantiles import NORMAL_95
from oed.reports.pages.comparisons.comparison_tables import (
    drift_table,
    merged_table,
    parameters_table,
    parts_table,
    runs_table,
    whole_table,
)
from oed.reports.pictures.comparison_pictures import (
    course_picture,
    friction_difference_picture,
    friction_runs_picture,
    significance_picture,
)
from oed.reports.rendering.page import Cell, Fact, Page, Section, Table, page_of
from oed.reports.rendering.picture import Picture
from oed.reports.rendering.provenance import Recording

# Curves in one panel, and panels of parameters over the runs.
CURVES, COURSES = 5, 12


def comparison_page(comparison: ModelComparison) -> Page:
    """Builds the page: differences, friction, parameters over the runs, and the merged estimate.

    Args:
        comparison: the comparison.
    """
    damaged, last = comparison.damaged, len(comparison.runs) - 1
    parts = {name for run in comparison.compared for name in comparison.parts(run)}
    return page_of(
        comparison,
        title="Comparison of models",
        robot=comparison.robot_name,
        logs=tuple(Recording(name=run.label, start=run.date) for run in comparison.runs),
        facts=(
            Fact(label="Runs", value=len(comparison.runs), note=f"order: {comparison.order}"),
            Fact(label="Parts that differ", value=len(parts)),
            Fact(
                label="Joints with a change of their own",
                value=len({item.joint for item in damaged}),
                status="act" if damaged else "neutral",
            ),
            Fact(label="Family-wise false-alarm rate", value=f"{100 * comparison.alpha:g} %", note="Holm"),
        ),
        sections=(
            Section(title="Runs", tables=(runs_table(comparison),)),
            Section(
                title="Differences",
                paragraphs=(
                    "Chi-square tests with the full covariances of the models, each run against the first. Three "
                    "families of tests (whole model, parts of joints, parameters) share the false-alarm rate. Within a "
                    "family, p-values are adjusted by Holm's method, which needs no independence of the tests. The "
                    "prior that the models share makes differences rather too small: tests are conservative.",
                    *(["Payloads on the flange are taken off the parameters first."] if comparison.payloads else []),
                ),
                pictures=(parts_picture(comparison),),
                tables=(whole_table(comparison),),
            ),
            Section(
                title="Tests of each part and parameter",
                tables=(parts_table(comparison), parameters_table(comparison)),
                folded=True,
            ),
            *_friction(comparison, last),
            *_courses(comparison),
            Section(
                title="Merged estimate",
                paragraphs=(
                    "Weighted by the inverse covariances. The scatter between runs (DerSimonian and Laird) widens the "
                    "standard errors where runs differ by more than their errors. The pull of the prior, which all "
                    "runs share, is not averaged out. model.json holds this estimate for oed predict.",
                ),
                tables=(merged_table(comparison),),
                folded=True,
            ),
        ),
    )


def parts_picture(comparison: ModelComparison) -> Picture:
    """Shows the smallest adjusted p-value over the runs of each part of each joint.

    Args:
        comparison: the comparison.
    """
    smallest: dict[str, dict[int, float]] = {}
    for item in comparison.differences:
        if item.level == "part" and item.joint is not None:
            row = smallest.setdefault(item.name.partition(" of joint ")[0], {})
            row[item.joint] = min(row.get(item.joint, 1.0), item.adjusted)
    return significance_picture(smallest, comparison.alpha, joint_names=comparison.runs[0].model.robot.joint_names)


def _friction(comparison: ModelComparison, last: int) -> tuple[Section, ...]:
    curves = comparison.curves
    if not curves:
        return ()
    robot = comparison.runs[0].model.robot
    shown = np.unique(np.linspace(0, last, min(CURVES, last + 1)).round().astype(int))
    joints = [curve.joint for curve in curves]
    base = [100 / np.maximum(np.abs(curve.torque[0]), 1e-12) for curve in curves]
    sentences = tuple(item.sentence() for item in comparison.friction if item.run == last and item.kind != "own")
    rows: list[tuple[Cell, ...]] = [
        (
            comparison.labels[item.run],
            item.joint,
            percent_of(item.total),
            interval_of(item.total, item.total_error),
            percent_of(item.common),
            percent_of(item.own),
            interval_of(item.own, item.own_scatter) if np.isfinite(item.own) else "–",
            item.kind,
        )
        for item in comparison.friction
    ]
    headings = ("run", "joint", "change", "95 %", "common to all joints", "of this joint", "95 %", "kind")
    return (
        Section(
            title="Friction",
            paragraphs=(
                f"{comparison.labels[last]} against {comparison.labels[0]}, mean over the common speeds. A change that "
                "all joints share is heat: friction falls when the robot is warmer. A change of one joint alone is a "
                "sign of damage or maintenance. Its interval allows for unequal heating of the joints, which scatters "
                "about the common change by 30 % of it.",
                *sentences,
            ),
            pictures=(
                friction_runs_picture(
                    [curve.speed for curve in curves],
                    [curve.torque[shown] for curve in curves],
                    [curve.error[shown] for curve in curves],
                    joints=joints,
                    labels=[comparison.labels[k] for k in shown],
                    kinds=robot.chain.kinds,
                    joint_names=robot.joint_names,
                ),
                friction_difference_picture(
                    [curve.speed for curve in curves],
                    [curve.difference[last] * s for curve, s in zip(curves, base, strict=True)],
                    [NORMAL_95 * curve.difference_error[last] * s for curve, s in zip(curves, base, strict=True)],
                    [
                        curve.simultaneous[last] * curve.difference_error[last] * s
                        for curve, s in zip(curves, base, strict=True)
                    ],
                    joints=joints,
                    kinds=robot.chain.kinds,
                    joint_names=robot.joint_names,
                ),
            ),
        ),
        Section(
            title="Change of friction, run by run",
            tables=(Table(headings=headings, rows=tuple(rows)),),
            folded=True,
        ),
    )


def _courses(comparison: ModelComparison) -> tuple[Section, ...]:
    """Parameters over the runs; of many, those that change most and an inertial one of each joint."""
    count = len(comparison.runs)
    x = np.arange(1, count + 1, dtype=float) if comparison.hours is None else comparison.hours
    label = "run" if comparison.hours is None else "time [h]"
    pictures: list[Picture] = []
    robot = comparison.runs[0].model.robot
    if comparison.curves:
        pictures.append(
            course_picture(
                [f"joint {curve.joint}" for curve in comparison.curves],
                ["N m" if robot.chain.kinds[curve.joint - 1] == "revolute" else "N" for curve in comparison.curves],
                [curve.level for curve in comparison.curves],
                [curve.level_error for curve in comparison.curves],
                x=x,
                x_label=label,
                labels=comparison.labels,
                title="Friction at 60 % of the largest speed over the runs",
                name="friction_course",
            )
        )
    common = comparison.common
    tests: dict[str, float] = {}
    for item in comparison.differences:
        if item.level == "parameter":
            tests[item.name] = max(tests.get(item.name, 0.0), item.statistic / item.dof)
    rigid = [i for i, c in enumerate(common.columns) if common.determined[i] and c.term == "rigid_body"]
    chosen = sorted(rigid, key=lambda i: -tests.get(common.columns[i].name, 0.0))[:COURSES]
    if chosen:
        pictures.append(
            course_picture(
                [common.columns[i].name for i in chosen],
                [common.columns[i].unit for i in chosen],
                [common.values[:, i] for i in chosen],
                [np.sqrt(common.covariances[:, i, i]) for i in chosen],
                x=x,
                x_label=label,
                labels=comparison.labels,
                title="Inertial parameters over the runs",
                name="inertial_course",
                caption="Those that differ most, with 95 % intervals.",
            )
        )
    tables = (drift_table(comparison),) if comparison.drifts else ()
    return (Section(title="Course over the runs", pictures=tuple(pictures), tables=tables),) if pictures else ()

"""The page of a loop: which experiments were made, why, and what each of them showed."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from oed.campaigns.loops.result import LoopResult
from oed.campaigns.loops.state import Experiment, Verdict, name_of
from oed.exports import read_trajectory
from oed.reports.pictures.trajectory_pictures import motion_picture
from oed.reports.rendering.page import Cell, Fact, Page, Section, Table, page_of
from oed.reports.rendering.palette import joint_role
from oed.reports.rendering.picture import Panel, Picture, Series
from oed.reports.rendering.provenance import Recording
from robots.common.plain import two_digits

CHANCE = 1e-3
"""Smallest p-value that is written as a number."""


def loop_page(result: LoopResult) -> Page:
    """Builds the page: the end, the errors over the experiments, and a section for each experiment."""
    last, rows = result.diagnosis, sum(_rows(experiment) for experiment in result.experiments)
    return page_of(
        result,
        title="Loop of experiments",
        robot=result.robot.title or result.robot.name,
        logs=tuple(
            Recording(name=run.recorded.log)
            for experiment in result.experiments
            for run in experiment.runs
            if run.recorded is not None
        ),
        facts=(
            Fact(label="Experiments", value=len(result.experiments), note=f"{rows} rows of feedback"),
            Fact(label="Effects found", value=len(last.findings), note=", ".join(last.causes)),
            Fact(
                label="Error of all joints, held-out data",
                value=f"{two_digits(_pooled(last.before))} → {two_digits(_pooled(last.after))} %",
                note="of the torque RMS, base model → extended model",
            ),
        ),
        sections=(_course(result), *(_section(result, k) for k in range(len(result.experiments)))),
    )


def _course(result: LoopResult) -> Section:
    seen = [_seen(experiment) for experiment in result.experiments]
    table = Table(
        headings=("experiment", "kind", "runs", "rows", "verdict", "causes"),
        rows=tuple(
            (
                number,
                experiment.kind.replace("_", " "),
                len(experiment.runs),
                _rows(experiment),
                verdict.verdict,
                ", ".join(verdict.causes) or "none",
            )
            for number, (experiment, verdict) in enumerate(zip(result.experiments, seen, strict=True), start=1)
        ),
        caption="Each verdict rests on the logs of all experiments up to it.",
    )
    numbers = np.arange(1.0, len(seen) + 1.0)
    series = []
    for joint in range(result.robot.n):
        for values, name, dash in (("before", "base model", "dash"), ("after", "extended model", "solid")):
            y = np.array([getattr(verdict, values)[joint] or np.nan for verdict in seen], dtype=float)
            series.append(
                Series(
                    x=numbers,
                    y=100 * y,
                    name=f"joint {joint + 1}, {name}",
                    kind="markers" if len(seen) == 1 else "lines",
                    role=joint_role(joint + 1),
                    dash=dash,  # type: ignore[arg-type]
                )
            )
    picture = Picture(
        title="Held-out error over the experiments",
        name="errors",
        panels=(Panel(title="", x_label="experiment", y_label="error over torque RMS [%]", series=tuple(series)),),
        columns=1,
        panel_height=260,
        caption="Residual of torque on data that the fit has not seen, over the RMS of the torque.",
    )
    return Section(title="The way to the result", pictures=(picture,), tables=(table,))


def _section(result: LoopResult, index: int) -> Section:
    experiment, robot = result.experiments[index], result.robot
    # What the last one shows stands among the findings.
    earlier = index + 1 < len(result.experiments)
    verdict = _seen(experiment)
    chance = "" if experiment.resolves is None else f" Stated probability: {100 * experiment.resolves:.0f} %."
    motion, _ = read_trajectory(Path(result.folder) / experiment.runs[0].trajectory, n=robot.n)
    return Section(
        title=f"Experiment {index + 1}: {experiment.kind.replace('_', ' ')}",
        paragraphs=(
            f"{experiment.why[:1].upper()}{experiment.why[1:]}.{chance}",
            f"Diagnosis: {verdict.verdict}. Files: {verdict.folder}.",
        ),
        pictures=(motion_picture(robot, motion, name=f"trajectory_{index + 1}"),),
        tables=(
            Table(
                headings=(
                    "cause",
                    "p-value",
                    "held-out error [%]",
                    "with it [%]",
                    *(("what it does",) if earlier else ()),
                ),
                rows=tuple(
                    (*_finding(finding), *((str(finding.get("sentence", "")),) if earlier else ()))
                    for finding in verdict.findings
                ),
                caption="What the logs up to here show beyond the base model.",
            ),
            Table(
                headings=("run", "log", "rows", "lost", "message delay [ms]", "rest before [s]"),
                rows=tuple(_run(experiment, k) for k in range(len(experiment.runs))),
                caption="Recordings. A dash: not known.",
            ),
        ),
    )


def _finding(finding: dict[str, object]) -> tuple[Cell, ...]:
    gain, p = finding["gain"], finding["p_value"]
    assert isinstance(gain, dict)
    chance = "-" if not isinstance(p, float) else f"{p:.2g}" if p >= CHANCE else f"< {CHANCE:g}"
    before, after = (None if gain[key] is None else 100 * gain[key] for key in ("nrmse_before", "nrmse_after"))
    return name_of(finding), chance, before, after


def _run(experiment: Experiment, index: int) -> tuple[Cell, ...]:
    run = experiment.runs[index]
    seen = run.recorded
    assert seen is not None
    delay = None if seen.delay is None else 1e3 * seen.delay
    return index + 1, seen.log, seen.rows, seen.lost, delay, run.pause


def _seen(experiment: Experiment) -> Verdict:
    assert experiment.diagnosis is not None
    return experiment.diagnosis


def _rows(experiment: Experiment) -> int:
    return sum(run.recorded.rows for run in experiment.runs if run.recorded is not None)


def _pooled(shares: list[float | None]) -> float:
    known = np.array([share for share in shares if share is not None])
    return float(100 * np.sqrt(np.mean(known**2))) if len(known) else float("nan")

"""The page of a diagnosis, for a reader who has never seen the robot."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from estimation.diagnosis.calibration import CLOSE_RIVAL_BIC
from estimation.diagnosis.results.actions import close_causes
from estimation.diagnosis.results.diagnosis import Diagnosis
from estimation.uncertainty.quantiles import NORMAL_95
from oed.reports.animations.animation import Animation
from oed.reports.pages.diagnosis_evidence import evidence_of
from oed.reports.pages.diagnosis_limits import limits_section
from oed.reports.pages.diagnosis_simulation import simulation_section
from oed.reports.pages.motions.diagnosis_motion import diagnosis_animation
from oed.reports.pages.motions.motion_report import animation_section
from oed.reports.pictures.diagnosis_pictures import cause_picture, gain_picture
from oed.reports.pictures.torque_pictures import torque_picture
from oed.reports.rendering.joint_units import joint_titles
from oed.reports.rendering.page import Cell, Fact, Page, Section, Table, page_of
from oed.reports.rendering.picture import Picture
from oed.reports.rendering.provenance import recordings_of
from robots.common.arrays import Array
from robots.common.plain import percent, significant, two_digits
from robots.signals import Log

SMALL = 1e-12
"""Smallest probability that is written: the tail of the noise distribution is unknown beyond it."""


def diagnosis_page(diagnosis: Diagnosis, animation: Animation | None = None, *, log: Log | None = None) -> Page:
    """Builds the page: findings with their evidence, gain of the extended model, detection limits, next step.

    Args:
        diagnosis: just made; one that was loaded from a file has no curves.
        animation: the robot in 3-D with the joints marked that have a finding.
        log: one of the logs, which the robot plays in 3-D where no animation is given.
    """
    if animation is None and log is not None:
        animation = diagnosis_animation(diagnosis, log)
    robot = diagnosis.model.robot
    sections = [_torque(diagnosis)]
    if animation is not None:
        sections.append(animation_section(animation))
    sections += [_finding(diagnosis, index) for index in range(len(diagnosis.findings))]
    if diagnosis.simulation is not None:
        sections.append(simulation_section(diagnosis.simulation, robot.joint_names, robot.chain.kinds))
    sections.append(_next(diagnosis))
    sections.append(limits_section(diagnosis.limits, folded=bool(diagnosis.findings)))
    return page_of(
        diagnosis,
        title="Diagnosis",
        robot=robot.title or robot.name,
        logs=recordings_of(diagnosis.model.provenance.get("logs", ())),
        facts=_facts(diagnosis),
        sections=sections,
        seed=diagnosis.model.provenance.get("seed"),
    )


def _facts(diagnosis: Diagnosis) -> tuple[Fact, ...]:
    facts = [Fact(label="Effects found", value=len(diagnosis.findings))]
    if np.isfinite(diagnosis.baseline).any():
        change = np.nan_to_num(diagnosis.baseline - diagnosis.extended)
        own = {finding.joint for finding in diagnosis.findings}
        if own and None not in own:
            # Only joints with a finding: on other joints the change comes from the base model.
            change[[j for j in range(len(change)) if j + 1 not in own]] = -np.inf
        worst = int(np.argmax(change))
        facts += [
            Fact(
                label=f"Error of joint {worst + 1}, held-out data",
                value=f"{two_digits(100 * diagnosis.baseline[worst])} → {percent(diagnosis.extended[worst])}",
                note="of its torque RMS, base model → extended model",
                status="good" if diagnosis.extended[worst] < diagnosis.baseline[worst] else "neutral",
            ),
            Fact(
                label="Error of all joints, held-out data",
                value=f"{two_digits(100 * _pooled(diagnosis.baseline))} → {percent(_pooled(diagnosis.extended))}",
                note="root mean square over joints",
            ),
        ]
    if diagnosis.findings:
        chance = max(finding.p_value for finding in diagnosis.findings)
        facts.append(
            Fact(label="False-alarm probability", value=_chance(chance, 100.0) + " %", note="of the weakest finding")
        )
    return tuple(facts)


def _chance(p: float, times: float = 1.0) -> str:
    """Writes a probability; below `SMALL`, writes that it is smaller than that."""
    return f"{times * p:.2g}" if p >= SMALL else f"< {times * SMALL:.0g}"


def _pooled(values: Array) -> float:
    known = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(known**2))) if len(known) else float("nan")


def _torque(diagnosis: Diagnosis) -> Section:
    robot, trace = diagnosis.model.robot, diagnosis.trace
    assert trace is not None
    known = np.isfinite(diagnosis.baseline).any()
    pictures: list[Picture] = []
    if known:
        pictures.append(gain_picture(diagnosis.baseline, diagnosis.extended, joint_names=robot.joint_names))
    pictures.append(
        torque_picture(
            trace.t,
            trace.measured,
            trace.measured - trace.after,
            joint_names=robot.joint_names,
            kinds=robot.chain.kinds,
            why_gaps="in rows that do not count for a joint: it rests or reverses there, and its friction is not known",
        )
    )
    titles = joint_titles(robot.joint_names, robot.n)
    rows: list[tuple[Cell, ...]] = []
    for j, title in enumerate(titles):
        old, new, every = (
            None if not np.isfinite(e[j]) else 100 * float(e[j])
            for e in (diagnosis.baseline, diagnosis.extended, diagnosis.every_row)
        )
        gain = None if old is None or new is None or not old else 100 * (1 - new / old)
        rows.append((title, old, new, gain, every))
    table = Table(
        headings=("joint", "base model [%]", "extended model [%]", "reduction [%]", "all rows [%]"),
        rows=tuple(rows),
        caption=(
            "RMS error of the simulated torque divided by the torque RMS, on held-out data. Rows at standstill or "
            "velocity reversal do not count for a joint, because its friction is not determined there. The last "
            "column counts all rows, as `oed predict` does."
        ),
    )
    return Section(
        title="Measured and simulated torque",
        paragraphs=(f"Measured torque, and torque of the extended model, on {diagnosis.how_unseen}.",),
        pictures=tuple(pictures),
        tables=(table,) if known else (),
    )


def _finding(diagnosis: Diagnosis, index: int) -> Section:
    finding = diagnosis.findings[index]
    place = "the whole robot" if finding.joint is None else f"joint {finding.joint}"
    shown, gain = evidence_of(diagnosis, index), finding.gain
    values: list[tuple[Cell, ...]] = []
    for parameter in finding.parameters:
        value, (lower, upper) = parameter.value, parameter.ci95
        error = (upper - lower) / (2 * NORMAL_95)
        if not np.isfinite(error):
            interval = "not determined by these logs"
        elif error <= 0:
            interval = "chosen from a list of usual values"
        else:
            interval = f"{significant(lower, error)} to {significant(upper, error)}"
        values.append((parameter.name.replace("_", " "), significant(value, error), parameter.unit, interval))
    tables = [
        Table(
            headings=("parameter", "value", "unit", "95 % interval"),
            rows=tuple(values),
            align=("left", "right", "left", "left"),
        )
    ]
    evidence: list[tuple[Cell, ...]] = [
        ("probability of this pattern under noise alone (p-value)", _chance(finding.p_value)),
        ("BIC gain over the model without it", significant(finding.delta_bic, digits=3)),
    ]
    if np.isfinite(gain.nrmse_before):
        evidence.append(
            (
                f"error{finding.elsewhere} on held-out data",
                f"{100 * gain.nrmse_before:.3g} → {100 * gain.nrmse_after:.3g} % of the {shown.of} RMS",
            )
        )
    if np.isfinite(gain.ci95).all():
        low, high = gain.ci95
        evidence.append(("error reduction, 95 % interval", f"{100 * low:.2g} to {100 * high:.2g} percentage points"))
    tables.append(Table(headings=("evidence", "value"), rows=tuple(evidence)))
    if finding.rivals:
        tables.append(
            Table(
                headings=("alternative effect", "BIC difference"),
                rows=tuple((name.replace("_", " "), round(margin, 1)) for name, margin in finding.rivals),
                caption=f"Below {CLOSE_RIVAL_BIC:g} an alternative remains possible"
                f"{'' if close_causes(finding) else ': none does'}.",
            )
        )
    picture = cause_picture(
        shown.label,
        shown.coordinate,
        shown.before,
        shown.after,
        title=f"Residual {shown.of} of joint {shown.joint}",
        unit=shown.unit,
        name=f"cause-{index + 1}",
    )
    return Section(
        title=f"Finding {index + 1}: {finding.title}, {place}",
        pictures=(picture,),
        tables=tuple(tables),
    )


_UNLESS = (
    "No further experiment is needed to name the cause. One exception: a rare effect fits about as well: {}. If your "
    "robot may have it, check it separately."
)
_NO_EXPERIMENT = {
    "none": "No further experiment is needed.",
    "named": "No further experiment is needed to name the cause.",
    "ambiguous": "None of the known kinds of experiment would distinguish the remaining causes.",
    "unexplained": (
        "Part of the error has no known cause, and no experiment of the catalogue can identify it. Move the joint "
        "alone, slowly and fast, through the same range and with several loads. Check whether the residual depends on "
        "position, velocity or time as the findings above state."
    ),
}


def _next(diagnosis: Diagnosis) -> Section:
    following = diagnosis.next_experiment
    if following is None:
        rare = [name for finding in diagnosis.findings for name in close_causes(finding)]
        named = diagnosis.verdict == "named"
        text = _UNLESS.format(", ".join(rare)) if named and rare else _NO_EXPERIMENT[diagnosis.verdict]
        return Section(title="Next step", paragraphs=(f"{text}{_rough(diagnosis)}",))
    paragraphs = [f"Record {following.words}: {following.why}." if following.why else f"Record {following.words}."]
    rows: Sequence[tuple[Cell, ...]] = tuple(
        (one.words, round(100 * one.resolves), round(one.duration)) for one in following.ranking
    )
    tables = (
        (
            Table(
                headings=("experiment", "probability to name one cause [%]", "duration [s]"),
                rows=tuple(rows),
                align=("left", "right", "right"),
            ),
        )
        if rows
        else ()
    )
    if following.logged:
        paragraphs.append(
            f"The motion is that of {following.logged}. If that log starts or ends in motion, run its original "
            f"program instead."
        )
    return Section(title="Next step", paragraphs=tuple(paragraphs), tables=(*tables, *_runs(following.runs)))


def _rough(diagnosis: Diagnosis) -> str:
    """Names parameters that longer logs would determine better."""
    rough = [
        f"{', '.join(p.name.replace('_', ' ') for p in finding.parameters if not p.determined)} of {finding.title}"
        for finding in diagnosis.findings
        if not all(p.determined for p in finding.parameters)
    ]
    if diagnosis.verdict != "named" or not rough:
        return ""
    return f" Not well determined: {'; '.join(rough)}. More logs of this kind would improve them."


def _runs(runs: Sequence[Mapping[str, Any]]) -> tuple[Table, ...]:
    """The motions to play, in order."""
    if not runs:
        return ()
    rows: list[tuple[Cell, ...]] = [
        (
            f"next_experiment_{run['motion']}.csv",
            run["pause_s"],
            run["payload_kg"] or None,
            "unchanged" if run["gravity"] is None else ", ".join(f"{g:.4g}" for g in run["gravity"]),
        )
        for run in runs
    ]
    return (
        Table(
            headings=("play", "rest before it [s]", "payload [kg]", "gravity in the base frame [m/s2]"),
            rows=tuple(rows),
            align=("left", "right", "right", "left"),
        ),
    )

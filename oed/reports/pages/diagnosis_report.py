"""The page of a diagnosis, for a reader who has never seen the robot."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from estimation.diagnosis.calibration import CLOSE_RIVAL_BIC
from estimation.diagnosis.results.diagnosis import Diagnosis
from estimation.uncertainty.quantiles import NORMAL_95
from oed.reports.animations.animation import Animation
from oed.reports.pages.diagnosis_actions import findings_in, verdict_of
from oed.reports.pages.diagnosis_limits import limits_section
from oed.reports.pages.diagnosis_simulation import simulation_section
from oed.reports.pages.diagnosis_view import DiagnosisView, view_of
from oed.reports.pages.motions.diagnosis_motion import diagnosis_animation
from oed.reports.pages.motions.motion_report import animation_section
from oed.reports.pictures.diagnosis_pictures import cause_picture, gain_picture
from oed.reports.pictures.torque_pictures import torque_picture
from oed.reports.rendering.joint_units import joint_titles, joint_units
from oed.reports.rendering.page import Cell, Fact, Page, Section, Table
from oed.reports.rendering.picture import Picture
from oed.reports.rendering.provenance import footer
from oed.reports.rendering.saving import save_page
from oed.reports.rendering.significant import significant
from robots.common.files import ResultFolder
from robots.common.plain import percent, two_digits
from robots.signals import Log

Array = NDArray[np.float64]

SMALL = 1e-12
"""Smallest probability that is written: the tail of the noise distribution is unknown beyond it."""


def save_diagnosis_report(
    diagnosis: Diagnosis, folder: ResultFolder, *, log: Log | None = None, png: bool = False
) -> None:
    """Writes the page of a diagnosis, and its pictures as PNG on request.

    Args:
        diagnosis: what was found.
        folder: where the page goes.
        log: one of the logs, which the robot plays in 3-D.
        png: whether to write the pictures.
    """
    animation = None if log is None else diagnosis_animation(diagnosis, log)
    save_page(diagnosis_page(view_of(diagnosis), animation), folder, png=png)


def diagnosis_page(view: DiagnosisView, animation: Animation | None = None) -> Page:
    """Builds the page: findings with their evidence, gain of the extended model, detection limits, next step.

    Args:
        view: the diagnosis.
        animation: the robot in 3-D with the joints marked that have a finding.
    """
    sections = [_torque(view)]
    if animation is not None:
        sections.append(animation_section(animation))
    sections += [_finding(view, index) for index in range(len(view.findings))]
    if view.simulation is not None:
        sections.append(simulation_section(view.simulation, view.joint_names, view.kinds))
    if view.unexplained:
        sections.append(Section(title="Unexplained residual", paragraphs=view.unexplained))
    sections.append(_next(view))
    sections.append(limits_section(view.limits, folded=bool(view.findings)))
    return Page(
        title="Diagnosis",
        robot=view.robot,
        verdict=verdict_of(view),
        logs=view.logs,
        findings=findings_in(view),
        facts=_facts(view),
        sections=tuple(sections),
        footer=footer(view.seed),
    )


def _facts(view: DiagnosisView) -> tuple[Fact, ...]:
    facts = [Fact(label="Effects found", value=len(view.findings))]
    if np.isfinite(view.nrmse_before).any():
        change = np.nan_to_num(view.nrmse_before - view.nrmse_after)
        own = {finding.joint for finding in view.findings}
        if own and None not in own:
            # Only joints with a finding: on other joints the change comes from the base model.
            change[[j for j in range(len(change)) if j + 1 not in own]] = -np.inf
        worst = int(np.argmax(change))
        facts += [
            Fact(
                label=f"Error of joint {worst + 1}, held-out data",
                value=f"{two_digits(100 * view.nrmse_before[worst])} → {percent(view.nrmse_after[worst])}",
                note="of its torque RMS, base model → extended model",
                status="good" if view.nrmse_after[worst] < view.nrmse_before[worst] else "neutral",
            ),
            Fact(
                label="Error of all joints, held-out data",
                value=f"{two_digits(100 * _pooled(view.nrmse_before))} → {percent(_pooled(view.nrmse_after))}",
                note="root mean square over joints",
            ),
        ]
    if view.findings:
        chance = max(finding.p_value for finding in view.findings)
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


def _torque(view: DiagnosisView) -> Section:
    known = np.isfinite(view.nrmse_before).any()
    pictures: list[Picture] = []
    if known:
        pictures.append(gain_picture(view.nrmse_before, view.nrmse_after, joint_names=view.joint_names))
    pictures.append(
        torque_picture(
            view.t,
            view.measured,
            view.extended,
            joint_names=view.joint_names,
            kinds=view.kinds,
            why_gaps="in rows that do not count for a joint: it rests or reverses there, and its friction is not known",
        )
    )
    titles = joint_titles(view.joint_names, len(view.joint_names))
    rows: list[tuple[Cell, ...]] = []
    for j, title in enumerate(titles):
        old, new, every = (
            None if not np.isfinite(e[j]) else 100 * float(e[j])
            for e in (view.nrmse_before, view.nrmse_after, view.nrmse_every)
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
        paragraphs=(f"Measured torque, and torque of the extended model, on {view.unseen}.",),
        pictures=tuple(pictures),
        tables=(table,) if known else (),
    )


def _finding(view: DiagnosisView, index: int) -> Section:
    finding = view.findings[index]
    place = "the whole robot" if finding.joint is None else f"joint {finding.joint}"
    unit = finding.unit or joint_units(view.kinds, len(view.kinds))[finding.shown_on - 1].torque
    values: list[tuple[Cell, ...]] = []
    for name, value, unit_of, lower, upper in finding.parameters:
        error = (upper - lower) / (2 * NORMAL_95)
        if not np.isfinite(error):
            interval = "not determined by these logs"
        elif error <= 0:
            interval = "chosen from a list of usual values"
        else:
            interval = f"{significant(lower, error)} to {significant(upper, error)}"
        values.append((name.replace("_", " "), significant(value, error), unit_of, interval))
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
    if np.isfinite(finding.before):
        evidence.append(
            (
                f"error{finding.elsewhere} on held-out data",
                f"{100 * finding.before:.3g} → {100 * finding.after:.3g} % of the {finding.of} RMS",
            )
        )
    if np.isfinite(finding.interval).all():
        low, high = finding.interval
        evidence.append(("error reduction, 95 % interval", f"{100 * low:.2g} to {100 * high:.2g} percentage points"))
    tables.append(Table(headings=("evidence", "value"), rows=tuple(evidence)))
    if finding.rivals:
        tables.append(
            Table(
                headings=("alternative effect", "BIC difference"),
                rows=tuple((title, round(margin, 1)) for title, margin in finding.rivals),
                caption=f"Below {CLOSE_RIVAL_BIC:g} an alternative remains possible"
                f"{'' if finding.rivals[0][1] < CLOSE_RIVAL_BIC else ': none does'}.",
            )
        )
    picture = cause_picture(
        finding.label,
        finding.coordinate,
        finding.residual_before,
        finding.residual_after,
        title=f"Residual {finding.of} of joint {finding.shown_on}",
        unit=unit,
        name=f"cause-{index + 1}",
    )
    return Section(
        title=f"Finding {index + 1}: {finding.title}, {place}",
        paragraphs=(finding.sentence,),
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


def _next(view: DiagnosisView) -> Section:
    if not view.next_kind:
        rare = [title for finding in view.findings for title, worse in finding.rivals if worse < CLOSE_RIVAL_BIC]
        text = _UNLESS.format(", ".join(rare)) if view.verdict == "named" and rare else _NO_EXPERIMENT[view.verdict]
        return Section(title="Next step", paragraphs=(f"{text}{_rough(view)}",))
    paragraphs = [f"Record {view.next_kind}: {view.next_why}." if view.next_why else f"Record {view.next_kind}."]
    rows: Sequence[tuple[Cell, ...]] = tuple(
        (kind, round(100 * chance), round(duration)) for kind, chance, duration in view.next_ranking
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
    if view.next_logged:
        paragraphs.append(
            f"The motion is that of {view.next_logged}. If that log starts or ends in motion, run its original "
            f"program instead."
        )
    return Section(title="Next step", paragraphs=tuple(paragraphs), tables=(*tables, *_runs(view)))


def _rough(view: DiagnosisView) -> str:
    """Names parameters that longer logs would determine better."""
    rough = [
        f"{', '.join(name.replace('_', ' ') for name in finding.rough)} of {finding.title}"
        for finding in view.findings
        if finding.rough
    ]
    if view.verdict != "named" or not rough:
        return ""
    return f" Not well determined: {'; '.join(rough)}. More logs of this kind would improve them."


def _runs(view: DiagnosisView) -> tuple[Table, ...]:
    """The motions to play, in order."""
    if not view.next_runs:
        return ()
    rows: list[tuple[Cell, ...]] = [
        (
            f"next_experiment_{run['motion']}.csv",
            run["pause_s"],
            run["payload_kg"] or None,
            "unchanged" if run["gravity"] is None else ", ".join(f"{g:.4g}" for g in run["gravity"]),
        )
        for run in view.next_runs
    ]
    return (
        Table(
            headings=("play", "rest before it [s]", "payload [kg]", "gravity in the base frame [m/s2]"),
            rows=tuple(rows),
            align=("left", "right", "right", "left"),
        ),
    )

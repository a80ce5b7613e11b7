"""The page of identified drives."""

from __future__ import annotations

import numpy as np

from estimation.actuators import Actuators, DriveValue
from oed.reports.pictures.drive_pictures import drive_error_picture, drive_motion_picture, drive_parameter_picture
from oed.reports.rendering.page import Cell, Fact, Finding, Page, Section, Table, findings_of
from oed.reports.rendering.picture import Picture
from oed.reports.rendering.provenance import footer, recordings_of
from oed.reports.rendering.saving import save_page
from oed.reports.rendering.significant import significant
from robots.common.files import ResultFolder

UNEXPLAINED = 3.0
"""A joint whose held-out error is so many times the median of all joints is named as unexplained."""


def save_actuators_report(result: Actuators, folder: ResultFolder, *, png: bool = False) -> None:
    """Writes the page of identified drives, and its pictures as PNG on request."""
    save_page(actuators_page(result), folder, png=png)


def actuators_page(result: Actuators) -> Page:
    """Builds the page: motion, errors, parameters with intervals, what is not determined, and the next motion."""
    before, after = 1e3 * result.described_error, 1e3 * result.held_out_error
    motion = [drive_motion_picture(trace, result.joints) for trace in result.traces[:1]]
    return Page(
        title="Drives",
        robot=result.robot,
        verdict=f"The simulated motion misses the measured one by {after:.3g} mrad on {result.held_out}; as described, "
        f"by {before:.3g} mrad.",
        logs=recordings_of(result.provenance.get("logs", ())),
        findings=_findings(result),
        facts=(
            Fact(label="Held-out error", value=f"{after:.3g} mrad", note="RMS, mean of the joints"),
            Fact(label="As described", value=f"{before:.3g} mrad"),
            Fact(label="Parameters", value=len(result.parameters), note=f"{len(result.undetermined)} not determined"),
            Fact(label="Effects found", value=len(result.findings)),
        ),
        sections=(
            Section(
                title="Motion",
                paragraphs=(
                    "Measured and simulated positions of held-out data. The simulation sees the commands alone.",
                )
                if motion
                else (),
                pictures=(*motion, drive_error_picture(result.errors)),
            ),
            Section(
                title="Parameters",
                paragraphs=(
                    "The intervals hold the truth with 95 %, if the drive is of this form. They allow for correlated "
                    "noise.",
                    *result.notes[-1:],
                ),
                pictures=_parameter_pictures(result),
                tables=(_table(result),),
            ),
            Section(title="Next motion", paragraphs=(_next(result),)),
        ),
        footer=footer(),
    )


def _findings(result: Actuators) -> tuple[Finding, ...]:
    found = [
        Finding(
            code="drives.effect",
            subject=item.name,
            text=f"{item.title}: {item.states}. Held-out error {1e3 * item.before:.3g} -> {1e3 * item.after:.3g} mrad.",
        )
        for item in result.findings
    ]
    middle = float(np.median([error.held_out for error in result.errors]))
    for error in result.errors:
        if error.held_out > UNEXPLAINED * middle and len(result.errors) > 1:
            found.append(
                Finding(
                    code="drives.unexplained",
                    subject=error.name,
                    text=f"{1e3 * error.held_out:.3g} mrad remain, with no effect of the catalogue to explain them.",
                    action="look at its motion below; compare the joint with its like",
                )
            )
    open_ = result.undetermined
    if open_:
        names = ", ".join(value.name for value in open_[:6]) + (", ..." if len(open_) > 6 else "")
        found.append(
            Finding(
                code="drives.undetermined",
                text=f"The motion does not determine {len(open_)} of {len(result.parameters)} parameters: {names}.",
                action=_next(result),
            )
        )
    return (*found, *findings_of("drives.note", result.notes))


def _next(result: Actuators) -> str:
    kinds = {value.parameter for value in result.undetermined}
    parts = []
    if kinds & {"armature", "delay"}:
        parts.append("faster motion (steps, or sines of several Hz), which shows inertia and delay")
    if kinds & {"viscous", "coulomb", "stribeck"}:
        parts.append("constant speeds from slow to fast in both directions, which separate viscous and dry friction")
    if kinds & {"torque_offset", "encoder_zero", "mass_factor"}:
        parts.append("holds at poses with different gravity load")
    if kinds & {"kp", "kd", "kv", "kr", "ki"}:
        parts.append("a known payload, whose weight fixes the scale of gains")
    if not parts:
        return "All parameters are determined. To check them, play another motion and give its log as --held-out."
    return f"Log a motion with {'; '.join(parts)}."


def _parameter_pictures(result: Actuators) -> tuple[Picture, ...]:
    pictures = []
    for name in dict.fromkeys(value.parameter for value in result.parameters):
        rows = [value for value in result.parameters if value.parameter == name]
        if len(rows) > 1:
            pictures.append(drive_parameter_picture(name, rows))
    return tuple(pictures)


def _table(result: Actuators) -> Table:
    rows: list[tuple[Cell, ...]] = [
        (
            value.parameter,
            value.group,
            significant(value.value, value.standard_error),
            _interval(value),
            value.unit,
            significant(value.described, value.standard_error),
            value.status + (f"; only together with {', '.join(value.partners)}" if value.partners else ""),
        )
        for value in result.parameters
    ]
    return Table(
        headings=("parameter", "joint or class", "value", "95 % interval", "unit", "described", "status"),
        rows=tuple(rows),
    )


def _interval(value: DriveValue) -> str:
    return f"{significant(value.lower, value.standard_error)} to {significant(value.upper, value.standard_error)}"

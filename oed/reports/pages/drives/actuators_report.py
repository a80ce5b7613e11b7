"""The page of identified drives."""

from __future__ import annotations

from estimation.actuators import Actuators, DriveValue
from oed.reports.pictures.drive_pictures import drive_error_picture, drive_motion_picture, drive_parameter_picture
from oed.reports.rendering.page import Fact, Page, Section, Table, page_of, table_of
from oed.reports.rendering.picture import Picture
from oed.reports.rendering.provenance import recordings_of
from robots.common.plain import significant


def actuators_page(result: Actuators) -> Page:
    """Builds the page: motion, errors, parameters with intervals, what is not determined, and the next motion."""
    before, after = 1e3 * result.described_error, 1e3 * result.held_out_error
    motion = [drive_motion_picture(trace, result.joints) for trace in result.traces[:1]]
    return page_of(
        result,
        title="Drives",
        robot=result.robot,
        logs=recordings_of(result.provenance.get("logs", ())),
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
                ),
                pictures=_parameter_pictures(result),
                tables=(_table(result),),
            ),
            Section(title="Next motion", paragraphs=(result.next_motion,)),
        ),
    )


def _parameter_pictures(result: Actuators) -> tuple[Picture, ...]:
    pictures = []
    for name in dict.fromkeys(value.parameter for value in result.parameters):
        rows = [value for value in result.parameters if value.parameter == name]
        if len(rows) > 1:
            pictures.append(drive_parameter_picture(name, rows))
    return tuple(pictures)


def _table(result: Actuators) -> Table:
    return table_of(
        result.parameters,
        {
            "parameter": lambda value: value.parameter,
            "joint or class": lambda value: value.group,
            "value": lambda value: significant(value.value, value.standard_error),
            "95 % interval": _interval,
            "unit": lambda value: value.unit,
            "described": lambda value: significant(value.described, value.standard_error),
            "status": lambda value: (
                value.status + (f"; only together with {', '.join(value.partners)}" if value.partners else "")
            ),
        },
    )


def _interval(value: DriveValue) -> str:
    return f"{significant(value.lower, value.standard_error)} to {significant(value.upper, value.standard_error)}"

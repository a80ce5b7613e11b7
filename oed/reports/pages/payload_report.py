"""The page of a payload."""

from __future__ import annotations

import numpy as np

from estimation.payloads import PayloadEstimate
from estimation.payloads.result import METHODS
from oed.reports.pictures.parameter_pictures import error_bars_picture
from oed.reports.rendering.page import Cell, Fact, Page, Section, Table, page_of
from oed.reports.rendering.provenance import recordings_of

NAMES = {"mass": "mass", **{f"centre_{axis}": f"centre of mass, {axis}" for axis in "xyz"}}


def payload_page(payload: PayloadEstimate) -> Page:
    """Builds the page: the quantities with their intervals, and the torque errors without and with the payload."""
    mass, *rest = payload.quantities
    centre = rest[:3]
    errors = {
        label: np.array(
            [getattr(joint, key) / joint.torque_rms if joint.torque_rms else np.nan for joint in payload.joints]
        )
        for label, key in (("without payload", "without"), ("with payload", "residual"))
    }
    return page_of(
        payload,
        title="Payload",
        robot=payload.robot,
        logs=recordings_of(payload.provenance.get("logs", ())),
        facts=(
            Fact(label="Mass", value=f"{mass.text} kg"),
            Fact(
                label="Centre of mass",
                value=f"{', '.join(item.text for item in centre)} m" if payload.found else "–",
            ),
            Fact(label="Rows", value=payload.rows, note=f"by {METHODS[payload.method]}"),
        ),
        sections=(
            Section(
                title="Mass, centre and inertia",
                paragraphs=(
                    "The intervals hold the truth with 95 %. They allow for correlated noise and for what is not known "
                    "of the arm. The values are those of a body that can exist. Moments of inertia that the log does "
                    "not determine are those of a typical body of this mass, and have no interval.",
                ),
                tables=(_table(payload),),
            ),
            Section(
                title="Torque", pictures=(error_bars_picture(errors, joint_names=[j.name for j in payload.joints]),)
            ),
        ),
    )


def _table(payload: PayloadEstimate) -> Table:
    rows: list[tuple[Cell, ...]] = [
        (
            NAMES.get(item.name, f"{item.name} about the centre"),
            item.text,
            item.interval_text if known else "–",
            item.unit,
            "yes" if known else "no",
        )
        for item, known in zip(payload.quantities, payload.determined, strict=True)
    ]
    frame = "in the flange frame" if np.array_equal(payload.frame, np.eye(4)) else "in the frame of --frame"
    return Table(
        headings=("quantity", "value", "95 % interval", "unit", "determined"),
        rows=tuple(rows),
        caption=f"Centre of mass and axes {frame}.",
    )

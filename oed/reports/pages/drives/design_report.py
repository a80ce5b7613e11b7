"""The page of a designed motion for drives."""

from __future__ import annotations

import numpy as np

from oed.experiments.drives import DriveDesign
from oed.reports.rendering.page import Fact, Page, Section, Table, page_of
from oed.reports.rendering.palette import sequence_role
from oed.reports.rendering.picture import Panel, Picture, Series

SHOWN = 3000
"""Samples of a curve at most."""


def drive_design_page(design: DriveDesign) -> Page:
    """Builds the page: the commands, and the standard errors that they will bring beside those of a chirp."""
    share = slice(None, None, -(-len(design.t) // SHOWN))
    panel = Panel(
        x_label="time [s]",
        y_label="command [rad or m]",
        series=tuple(
            Series(x=design.t[share], y=design.command[share, j], name=name, role=sequence_role(j), kind="steps")
            for j, name in enumerate(design.joints)
        ),
    )
    rows = tuple(
        (i.parameter, i.group, f"{i.standard_error:.2g}", f"{i.of_chirp:.2g}", f"{i.ratio:.2g}", i.unit)
        for i in design.expected
    )
    return page_of(
        design,
        title="Motion for drives",
        robot=design.robot,
        facts=(
            Fact(label="Duration", value=f"{design.t[-1] - design.t[0]:.3g} s"),
            Fact(label="Ratio to a chirp", value=f"{design.ratio:.2g}", note="median of the standard errors"),
            Fact(label="Noise", value=f"{1e3 * design.noise:.2g} mrad", note="of measured positions"),
        ),
        sections=(
            Section(
                title="Commands",
                paragraphs=(f"Segments: {', '.join(design.segments)}.",),
                pictures=(Picture(title="Commanded positions", name="drive_commands", panels=(panel,)),),
            ),
            Section(
                title="Expected standard errors",
                tables=(
                    Table(
                        headings=("parameter", "joint", "standard error", "of a chirp", "ratio", "unit"),
                        rows=rows,
                        caption=f"Largest ratio: {np.nanmax([i.ratio for i in design.expected]):.2g}.",
                    ),
                ),
            ),
        ),
    )

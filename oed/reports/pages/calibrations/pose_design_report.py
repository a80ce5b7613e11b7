"""The page of a design of poses."""

from __future__ import annotations

import numpy as np

from oed.experiments.pose_designs import PoseDesign
from oed.experiments.safety_checks.freedom import freedom_text, is_free
from oed.reports.animations.building import animate
from oed.reports.rendering.page import Cell, Fact, Page, Section, Table, page_of, table_of
from oed.reports.rendering.picture import Panel, Picture, Series
from robots.common.plain import finite


def pose_design_page(design: PoseDesign) -> Page:
    """Builds the page: what the poses determine, the robot in 3-D on its way, and the poses."""
    return page_of(
        design,
        title="Poses for a calibration",
        robot=design.robot.name,
        facts=(
            Fact(label="Poses", value=len(design.q), note=f"{design.motion.duration:.0f} s of motion"),
            Fact(label="Parameters", value=len(design.parameters)),
            Fact(label="O1", value=design.observability["O1"], note="observability index"),
        ),
        sections=(
            Section(
                title="Motion",
                paragraphs=(
                    "The robot rests at each pose while it is measured.",
                    *([freedom_text(design.freedom)] if is_free(design.freedom) else []),
                ),
                animation=animate(design.robot, design.motion, margins=(), source="tour of the poses"),
            ),
            Section(title="Observability", pictures=(_picture(design),), tables=(_indices(design),)),
            Section(title="Expected standard errors", tables=(_expected(design),)),
            Section(title="Poses", tables=(_poses(design),), folded=True),
        ),
    )


def _picture(design: PoseDesign) -> Picture:
    before = design.exchanged_eigenvalues
    series = tuple(
        Series(
            x=np.arange(1.0, len(values) + 1.0),
            y=np.sqrt(np.maximum(values, 1e-300))[::-1],
            name=name,
            kind="markers",
            role=role,
        )
        for values, name, role in (
            (design.eigenvalues, "designed", "main"),
            *([] if before is None else [(before, "by exchange alone", "third")]),
            (design.random_eigenvalues, "random", "second"),
        )
    )
    panel = Panel(
        title="Singular values of the scaled Jacobian",
        x_label="direction",
        y_label="singular value",
        series=series,
    )
    return Picture(name="singular_values", title="How well each direction is determined", panels=(panel,))


def _indices(design: PoseDesign) -> Table:
    sets = design.compared
    rows: list[tuple[Cell, ...]] = [(name, *(own[name] for own in sets.values())) for name in design.observability]
    return Table(headings=("index", *sets), rows=tuple(rows), caption="Of as many poses each.")


def _expected(design: PoseDesign) -> Table:
    return table_of(
        zip(design.parameters, design.expected.tolist(), strict=True),
        {
            "parameter": lambda pair: pair[0].name,
            "expected standard error": lambda pair: finite(pair[0].shown[1] * pair[1]),
            "unit": lambda pair: pair[0].shown[0],
        },
    )


def _poses(design: PoseDesign) -> Table:
    limits = design.robot.limits
    headings = ("pose", *(f"q{i + 1} [{limits.unit(i)}]" for i in range(design.robot.n)))
    rows: list[tuple[Cell, ...]] = [(k + 1, *map(float, pose)) for k, pose in enumerate(design.q)]
    return Table(headings=headings, rows=tuple(rows))

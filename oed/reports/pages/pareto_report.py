"""The page of a Pareto front: what each criterion costs the others."""

from __future__ import annotations

from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from oed.experiments import ParetoFront
from oed.reports.rendering.page import Fact, Page, Section, Table, page_of
from oed.reports.rendering.picture import Panel, Picture, Series

WIDE = 5.0
"""Ratio of the largest to the smallest value from which an axis is logarithmic."""


def pareto_page(front: ParetoFront) -> Page:
    """Builds the page: the front as a picture and a table."""
    robot = front.designs[0].robot
    names = [criterion.name for criterion in front.criteria]
    rows = tuple(
        (point, *weights.tolist(), *values.tolist(), "yes" if good else "dominated")
        for point, (weights, values, good) in enumerate(
            zip(front.weights, front.values, front.efficient, strict=True), start=1
        )
    )
    headings = ("point", *(f"weight of {name}" for name in names), *names, "Pareto-optimal")
    return page_of(
        front,
        title="Designs for several criteria",
        robot=robot.title or robot.name,
        facts=tuple(Fact(label=f"Best {c.label}", value=_best(front, k)) for k, c in enumerate(front.criteria)),
        sections=(
            Section(
                title="Pareto front",
                paragraphs=(
                    (
                        "Each point is a design that respects all limits; its trajectory is in the folder with its "
                        "number. The axes name criteria for which larger is better."
                    ),
                    _cost(front),
                ),
                pictures=(_picture(front),),
                tables=(Table(headings=headings, rows=rows, caption="Criteria of the optimised motion."),),
            ),
        ),
    )


def _best(front: ParetoFront, k: int) -> float:
    column = front.values[:, k]
    return float(column.max() if front.criteria[k].larger_is_better else column.min())


def _cost(front: ParetoFront) -> str:
    """Compares the designs for a single criterion with the best of each criterion."""
    said = []
    for k, criterion in enumerate(front.criteria):
        (own,) = np.flatnonzero(front.weights[:, k] == 1.0)
        others = [
            f"{other.name} {front.values[own, j]:.4g} instead of {_best(front, j):.4g}"
            for j, other in enumerate(front.criteria)
            if j != k
        ]
        said.append(f"designing for {criterion.name} alone gives {' and '.join(others)}")
    text = "; ".join(said)
    return f"{text[0].upper()}{text[1:]}."


def _picture(front: ParetoFront) -> Picture:
    panels = []
    for i, j in combinations(range(len(front.criteria)), 2):
        series = []
        for good, role, name in ((True, "main", "Pareto-optimal"), (False, "neutral", "dominated")):
            chosen = np.flatnonzero(front.efficient == good)
            if chosen.size:
                texts = tuple(f"point {point + 1}" for point in chosen)
                x, y = front.values[chosen, i], front.values[chosen, j]
                series.append(Series(x=x, y=y, name=name, kind="markers", role=role, texts=texts))
        panels.append(
            Panel(
                x_label=_axis(front, i),
                y_label=_axis(front, j),
                x_log=_wide(front.values[:, i]),
                y_log=_wide(front.values[:, j]),
                series=tuple(series),
            )
        )
    return Picture(name="pareto", title="Criteria of each design", panels=tuple(panels))


def _wide(values: NDArray[np.float64]) -> bool:
    """Whether only a logarithmic axis shows all values apart."""
    return bool(values.min() > 0.0 and values.max() > WIDE * values.min())


def _axis(front: ParetoFront, k: int) -> str:
    criterion = front.criteria[k]
    return f"{criterion.label} (larger is better)" if criterion.larger_is_better else criterion.label

"""A page as one HTML file that needs nothing but a browser: no network, no other file."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any

from markupsafe import Markup

from oed.reports.rendering.page import Cell, Page, is_number
from oed.reports.rendering.palette import INK
from oed.reports.rendering.picture import Picture, legend_entries
from oed.reports.rendering.plotly_ import MARGINS, height_of, to_plotly
from robots.common.plain import significant
from robots.common.records.findings import WORDS

TEMPLATES = Path(__file__).parent / "templates"

# The basic bundle has all that pictures use, scatter and bar, in 1.2 MB; the script of the Python package has 4.8 MB.
# It is a plain file of this package: no step of the build fetches it, and no browser has to decompress it.
SCRIPT = Path(__file__).parent / "plotly_js" / "plotly-basic.min.js"


def render(page: Page, *, template: str = "page.html.j2", context: Mapping[str, Any] | None = None) -> str:
    """Writes a page as one HTML file; texts are escaped, and plotly is inside if there are pictures.

    Args:
        page: the content.
        template: a template of this package that extends ``base.html.j2``.
        context: more names for that template.

    Returns:
        The text of the file.
    """
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    environment = Environment(
        loader=FileSystemLoader(TEMPLATES),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {"cell": format_cell, "is_number": is_number, "summary": summary_rows}
    return environment.get_template(template).render(
        page=page,
        words=WORDS,
        anchors=_anchors([section.title for section in page.sections]),
        figures={picture.name: _figure_json(picture) for picture in page.pictures},
        legends={picture.name: legend_entries(picture) for picture in page.pictures},
        ink=INK,
        plotly=_plotly_script() if page.pictures else Markup(""),
        **(context or {}),
    )


def format_cell(value: Cell) -> str:
    """Writes a cell: numbers with four digits, booleans as yes and no, None as a dash.

    Args:
        value: what the cell holds.
    """
    if value is None:
        return "–"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, str) or hasattr(value, "__index__"):
        return str(value)
    return significant(float(value))


def summary_rows(picture: Picture) -> list[tuple[str, str, str, int, Cell, Cell, Cell]]:
    """Lists panel, series, axis label, number of points, smallest, mean and largest value of each series."""
    rows: list[tuple[str, str, str, int, Cell, Cell, Cell]] = []
    for panel in picture.panels:
        for series in panel.series:
            known = series.y[series.y == series.y]
            low, mean, high = (known.min(), known.mean(), known.max()) if len(known) else (None, None, None)
            rows.append((panel.title, series.name, panel.y_label, len(known), low, mean, high))
    return rows


def _anchors(titles: Sequence[str]) -> list[str]:
    """Gives each section an identifier that is free of spaces and used once."""
    anchors: list[str] = []
    for title in titles:
        stem = "section-" + (re.sub(r"[^a-z0-9]+", "-", title.lower()).strip("-") or "untitled")
        anchor, number = stem, 2
        while anchor in anchors:
            anchor, number = f"{stem}-{number}", number + 1
        anchors.append(anchor)
    return anchors


def _figure_json(picture: Picture) -> Markup:
    # "<" cannot end the script element once it is written as an escape of JSON.
    return Markup(_for_page(picture).to_json().replace("<", "\\u003c"))


def _for_page(picture: Picture) -> Any:
    """Draws a picture without its legend, with what the page needs to arrange the panels by its own width."""
    figure = to_plotly(picture)
    height, gap = height_of(picture)
    figure.update_layout(
        showlegend=False,
        height=height,
        margin=MARGINS,
        meta={
            "columns": picture.columns,
            "panelHeight": picture.panel_height,
            "gap": gap,
            "margin": height - picture.rows * picture.panel_height - (picture.rows - 1) * gap,
            "panels": [{"title": p.title, "x": p.x_label, "y": p.y_label} for p in picture.panels],
        },
    )
    return figure


@lru_cache(maxsize=1)
def _plotly_script() -> Markup:
    """The basic bundle of plotly.js, without an address that a reader or a scanner could take for a link."""
    # An escaped slash is a slash to JavaScript, in strings of every kind.
    text = SCRIPT.read_text(encoding="utf-8").replace("http://", "http:\\/\\/").replace("https://", "https:\\/\\/")
    return Markup(text.replace("</script", "<\\/script").replace("<!--", "<\\!--"))

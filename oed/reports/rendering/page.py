"""A report as one HTML file that needs nothing but a browser: no network, no other file."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any, Literal

from markupsafe import Markup

from oed.reports.rendering.palette import INK
from oed.reports.rendering.picture import Picture
from oed.reports.rendering.plotly_ import to_plotly
from oed.reports.rendering.significant import significant
from robots.common.errors import InputError

Status = Literal["good", "warning", "bad", "neutral"]
Cell = str | int | float | bool | None

STATUSES = ("good", "warning", "bad", "neutral")
ALIGNMENTS = ("left", "right", "center")
TEMPLATES = Path(__file__).parent / "templates"


@dataclass(frozen=True, kw_only=True)
class Fact:
    """A number that an engineer looks for first.

    Args:
        label: what it is.
        value: the number with its unit, as text or as a number that is rounded to four digits.
        note: what to compare it with, or where it comes from.
        status: good, neutral, warning or bad.
    """

    label: str
    value: Cell
    note: str = ""
    status: Status = "neutral"

    def __post_init__(self) -> None:
        _check("status", self.status, STATUSES)


@dataclass(frozen=True, kw_only=True)
class Table:
    """A table of texts and numbers.

    Args:
        headings: names of the columns.
        rows: cells, row by row; numbers are rounded to four digits, None is a dash.
        caption: what the table shows.
        align: "left", "right" or "center" per column; empty puts columns of numbers to the right.

    Raises:
        InputError: a row or `align` of another length than the headings, or an unknown alignment.
    """

    headings: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]
    caption: str = ""
    align: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "headings", tuple(self.headings))
        object.__setattr__(self, "rows", tuple(tuple(row) for row in self.rows))
        for number, row in enumerate(self.rows, start=1):
            if len(row) != len(self.headings):
                raise InputError(f"{len(row)} cells", row=number, allowed=f"{len(self.headings)}, one per heading")
        align = tuple(self.align) or tuple(self._natural_alignment(index) for index in range(len(self.headings)))
        if len(align) != len(self.headings):
            raise InputError(f"{len(align)} alignments", allowed=f"{len(self.headings)}, one per heading")
        for choice in align:
            _check("align", choice, ALIGNMENTS)
        object.__setattr__(self, "align", align)

    def _natural_alignment(self, index: int) -> str:
        cells = [row[index] for row in self.rows if row[index] is not None]
        return "right" if cells and all(_is_number(cell) for cell in cells) else "left"


@dataclass(frozen=True, kw_only=True)
class Section:
    """A part of the page with a heading of its own.

    Args:
        title: its heading, and its entry in the table of contents.
        paragraphs: text before the pictures.
        pictures: pictures, in order.
        tables: tables, after the pictures.
        folded: whether it is closed until someone opens it.
    """

    title: str
    paragraphs: tuple[str, ...] = ()
    pictures: tuple[Picture, ...] = ()
    tables: tuple[Table, ...] = ()
    folded: bool = False


@dataclass(frozen=True, kw_only=True)
class Footer:
    """Where a page comes from.

    Args:
        tool: name and version of the tool.
        date: when the result was computed.
        command: the command that gives it again.
    """

    tool: str = ""
    date: str = ""
    command: str = ""


@dataclass(frozen=True, kw_only=True)
class Page:
    """A report.

    Args:
        title: what it is about.
        verdict: the answer, in one sentence.
        subtitle: robot, file or experiment.
        status: whether the verdict is good news.
        facts: the numbers that support it, for the first screen.
        warnings: limitations of the result.
        sections: the rest.
        footer: where the page comes from.

    Raises:
        InputError: two pictures of one name.
    """

    title: str
    verdict: str
    subtitle: str = ""
    status: Status = "neutral"
    facts: tuple[Fact, ...] = ()
    warnings: tuple[str, ...] = ()
    sections: tuple[Section, ...] = ()
    footer: Footer = field(default_factory=Footer)

    def __post_init__(self) -> None:
        _check("status", self.status, STATUSES)
        names = [picture.name for picture in self.pictures]
        for name in names:
            if names.count(name) > 1:
                raise InputError(f"two pictures named {name!r} in one page", allowed="names that differ")

    @property
    def pictures(self) -> tuple[Picture, ...]:
        """All pictures, in order."""
        return tuple(picture for section in self.sections for picture in section.pictures)


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
    environment.filters |= {"cell": format_cell, "is_number": _is_number}
    return environment.get_template(template).render(
        page=page,
        anchors=_anchors([section.title for section in page.sections]),
        figures={picture.name: _figure_json(picture) for picture in page.pictures},
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


def _is_number(value: object) -> bool:
    # Numbers of numpy are numbers too; numpy.float64 is a float, numpy.int64 no int.
    return hasattr(value, "__float__") and not isinstance(value, bool | str)


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
    return Markup(to_plotly(picture).to_json().replace("<", "\\u003c"))


@lru_cache(maxsize=1)
def _plotly_script() -> Markup:
    """The whole of plotly.js, without an address that a reader or a scanner could take for a link."""
    from plotly.offline import get_plotlyjs

    # An escaped slash is a slash to JavaScript, in strings of every kind.
    text = get_plotlyjs().replace("http://", "http:\\/\\/").replace("https://", "https:\\/\\/")
    return Markup(text.replace("</script", "<\\/script").replace("<!--", "<\\!--"))


def _check(name: str, value: str, allowed: tuple[str, ...]) -> None:
    if value not in allowed:
        raise InputError(f"found {value!r}", column=name, allowed=", ".join(allowed))

"""What a report says, free of its form: verdict, findings, key figures, sections and origin."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal, TypeVar

from oed.reports.animations.animation import Animation
from oed.reports.rendering.picture import Picture
from oed.reports.rendering.provenance import Footer, Recording, footer
from robots.common.errors import InputError
from robots.common.records import Result
from robots.common.records.findings import ORDER, Finding, Level, severity

Status = Literal["good", "note", "act", "neutral"]
Cell = str | int | float | bool | None
Item = TypeVar("Item")

STATUSES = ("good", "note", "act", "neutral")
ALIGNMENTS = ("left", "right", "center")


@dataclass(frozen=True, kw_only=True)
class Fact:
    """A key figure.

    Args:
        label: what it is.
        value: the number with its unit, as text or as a number that is rounded to four digits.
        note: what to compare it with, or where it comes from.
        status: good, note, act or neutral.
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
        return "right" if cells and all(is_number(cell) for cell in cells) else "left"


@dataclass(frozen=True, kw_only=True)
class Section:
    """A part of the page with a heading of its own.

    Args:
        title: its heading, and its entry in the table of contents.
        paragraphs: text before the pictures.
        pictures: pictures, in order.
        tables: tables, after the pictures.
        animation: a robot in 3-D that plays a motion, before the pictures.
        folded: whether it is closed until someone opens it.
    """

    title: str
    paragraphs: tuple[str, ...] = ()
    pictures: tuple[Picture, ...] = ()
    tables: tuple[Table, ...] = ()
    animation: Animation | None = None
    folded: bool = False


@dataclass(frozen=True, kw_only=True)
class Page:
    """A report.

    Args:
        title: what it is about.
        verdict: the answer in one sentence that a person can act on.
        robot: its name; empty for several robots.
        logs: recordings that the result rests on.
        findings: everything that a reader must know, each as one row; the most urgent is shown first.
        facts: the experts' key figures.
        sections: the rest.
        footer: where the page comes from.

    Raises:
        InputError: two pictures of one name.
    """

    title: str
    verdict: str
    robot: str = ""
    logs: tuple[Recording, ...] = ()
    findings: tuple[Finding, ...] = ()
    facts: tuple[Fact, ...] = ()
    sections: tuple[Section, ...] = ()
    footer: Footer = field(default_factory=Footer)

    def __post_init__(self) -> None:
        urgent = sorted(self.findings, key=lambda item: -ORDER.index(item.level))
        object.__setattr__(self, "findings", tuple(urgent))
        names = [picture.name for picture in self.pictures]
        for name in names:
            if names.count(name) > 1:
                raise InputError(f"two pictures named {name!r} in one page", allowed="names that differ")

    @property
    def listed(self) -> tuple[Finding, ...]:
        """The findings as rows: what the verdict states already is not said again."""
        return tuple(
            replace(finding, action="" if finding.action in self.verdict else finding.action)
            for finding in self.findings
            if finding.text.rstrip(".") not in self.verdict
        )

    @property
    def level(self) -> Level:
        """How urgent the page is: as its most urgent finding."""
        return severity(finding.code for finding in self.findings)

    @property
    def pictures(self) -> tuple[Picture, ...]:
        """All pictures, in order."""
        return tuple(picture for section in self.sections for picture in section.pictures)

    @property
    def animations(self) -> tuple[Animation, ...]:
        """All robots in 3-D, in order."""
        return tuple(section.animation for section in self.sections if section.animation is not None)

    @property
    def dates(self) -> tuple[str, ...]:
        """When the logs were recorded, each date once; empty where no clock has a date."""
        return tuple(dict.fromkeys(log.date for log in self.logs if log.date))


def page_of(
    result: Result,
    *,
    title: str,
    robot: str = "",
    logs: Iterable[Recording] = (),
    facts: Iterable[Fact] = (),
    sections: Iterable[Section | None] = (),
    seed: int | None = None,
) -> Page:
    """Arranges the page of a result: what follows from it, what to know, key figures, evidence, and where it is from.

    Args:
        result: gives conclusion and remarks.
        title: what the page is about.
        robot: its name.
        logs: recordings that the result rests on.
        facts: the experts' key figures.
        sections: pictures and tables, in order; None is left out.
        seed: of the random numbers, where the result states it.
    """
    return Page(
        title=title,
        robot=robot,
        verdict=result.conclusion,
        logs=tuple(logs),
        findings=result.remarks,
        facts=tuple(facts),
        sections=tuple(section for section in sections if section is not None),
        footer=footer(seed),
    )


def table_of(
    items: Iterable[Item],
    columns: Mapping[str, Callable[[Item], Cell]],
    *,
    caption: str = "",
    align: Sequence[str] = (),
) -> Table:
    """Makes a table with a row for each item.

    Args:
        items: in the order of the rows.
        columns: what each column shows of an item, by its heading.
        caption: what the table shows.
        align: see `Table`.
    """
    rows = tuple(tuple(cell(item) for cell in columns.values()) for item in items)
    return Table(headings=tuple(columns), rows=rows, caption=caption, align=tuple(align))


def is_number(value: object) -> bool:
    """Says whether a cell holds a number, of Python or of numpy."""
    # Numbers of numpy are numbers too; numpy.float64 is a float, numpy.int64 no int.
    return hasattr(value, "__float__") and not isinstance(value, bool | str)


def _check(name: str, value: str, allowed: tuple[str, ...]) -> None:
    if value not in allowed:
        raise InputError(f"found {value!r}", column=name, allowed=", ".join(allowed))

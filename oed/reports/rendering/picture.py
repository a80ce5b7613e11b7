"""What a figure shows, free of any drawing library: `to_plotly` and `to_matplotlib` draw it."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from oed.reports.rendering.palette import colour, translucent
from robots.common.arrays import Array
from robots.common.errors import InputError

Kind = Literal["lines", "markers", "bars", "steps"]
Dash = Literal["solid", "dash", "dot"]

KINDS = ("lines", "markers", "bars", "steps")
DASHES = ("solid", "dash", "dot")


@dataclass(frozen=True, kw_only=True, eq=False)
class Series:
    """One curve, cloud of points or set of bars.

    Args:
        x: abscissae, (N,).
        y: ordinates, (N,); NaN leaves a gap.
        name: its entry in the legend; series of one name share an entry, an empty name has none.
        kind: how it is drawn; "steps" holds each value up to the next.
        error: half widths, (N,), or None: error bars of markers and bars, a ribbon around lines.
        role: the role that gives its colour.
        dash: the stroke of a line.
        opacity: from 0 to 1; 0 draws only the ribbon of a line with errors.
        texts: a text per point for hovering, (N,) or empty.

    Raises:
        InputError: arrays of different lengths, or an unknown kind, dash or role.
    """

    x: Array
    y: Array
    name: str = ""
    kind: Kind = "lines"
    error: Array | None = None
    role: str = "main"
    dash: Dash = "solid"
    opacity: float = 1.0
    texts: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for name in ("x", "y", "error"):
            value = getattr(self, name)
            if value is not None:
                object.__setattr__(self, name, _vector(name, value))
        lengths = {"y": len(self.y)} | ({} if self.error is None else {"error": len(self.error)})
        lengths |= {"texts": len(self.texts)} if self.texts else {}
        for name, length in lengths.items():
            if length != len(self.x):
                raise InputError(f"{length} values", column=name, allowed=f"{len(self.x)}, as many as x")
        _choice("kind", self.kind, KINDS)
        _choice("dash", self.dash, DASHES)
        _check_role(self.role)


@dataclass(frozen=True, kw_only=True)
class Line:
    """A horizontal line, such as a limit.

    Args:
        value: where, on the y axis.
        label: what is written beside it.
        role: the role that gives its colour.
        dash: its stroke.
    """

    value: float
    label: str = ""
    role: str = "limit"
    dash: Dash = "dash"

    def __post_init__(self) -> None:
        _choice("dash", self.dash, DASHES)
        _check_role(self.role)


@dataclass(frozen=True, kw_only=True)
class Band:
    """A horizontal band, such as an interval of confidence.

    Args:
        low: its lower edge on the y axis.
        high: its upper edge.
        label: its entry in the legend; empty for none.
        role: the role that gives its colour.
    """

    low: float
    high: float
    label: str = ""
    role: str = "neutral"

    def __post_init__(self) -> None:
        _check_role(self.role)


@dataclass(frozen=True, kw_only=True)
class Span:
    """A vertical stripe, such as a segment of an experiment.

    Args:
        start: its left edge on the x axis.
        end: its right edge.
        label: its entry in the legend; empty for none.
        role: the role that gives its colour.
    """

    start: float
    end: float
    label: str = ""
    role: str = "neutral"

    def __post_init__(self) -> None:
        _check_role(self.role)


@dataclass(frozen=True, kw_only=True, eq=False)
class Panel:
    """One pair of axes.

    Args:
        title: what it shows, in a few words.
        x_label: quantity and unit of the x axis.
        y_label: quantity and unit of the y axis.
        series: what is drawn.
        lines: horizontal lines.
        bands: horizontal bands.
        spans: vertical stripes.
        categories: names of the positions 0, 1, ... of the x axis, for bars; empty for numbers.
        x_log: whether the x axis is logarithmic.
        y_log: whether the y axis is logarithmic.
        y_range: the limits of the y axis, or None for all of the data.
        note: a remark in the upper corner.
    """

    title: str = ""
    x_label: str = ""
    y_label: str = ""
    series: tuple[Series, ...] = ()
    lines: tuple[Line, ...] = ()
    bands: tuple[Band, ...] = ()
    spans: tuple[Span, ...] = ()
    categories: tuple[str, ...] = ()
    x_log: bool = False
    y_log: bool = False
    y_range: tuple[float, float] | None = None
    note: str = ""

    def __post_init__(self) -> None:
        for item in fields(self):
            value = getattr(self, item.name)
            if isinstance(value, list):
                object.__setattr__(self, item.name, tuple(value))

    @property
    def bar_group_width(self) -> float:
        """How much of the x axis the bars at one position take together."""
        places = [np.unique(series.x) for series in self.series if series.kind == "bars"]
        steps = [float(np.diff(place).min()) for place in places if len(place) > 1]
        return (0.68 if self.categories else 0.92) * min(steps, default=1.0)


@dataclass(frozen=True, kw_only=True, eq=False)
class Picture:
    """Panels in rows, under one title.

    Args:
        title: what the picture says.
        name: the stem of its file name, and its identifier in a page.
        panels: row by row.
        columns: panels per row.
        shared_x: whether all panels show the same part of the x axis.
        panel_height: height of a panel on a screen [px].
        caption: how to read it, in a sentence or two.

    Raises:
        InputError: no panels, no columns, or a name that is no file name.
    """

    title: str
    name: str
    panels: tuple[Panel, ...]
    columns: int = 1
    shared_x: bool = False
    panel_height: int = 260
    caption: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "panels", tuple(self.panels))
        if not self.panels:
            raise InputError(f"the picture {self.name!r} has no panels", allowed="one or more")
        if self.columns < 1:
            raise InputError(f"the picture {self.name!r} has {self.columns} columns", allowed="one or more")
        if not self.name or not all(letter.isalnum() or letter in "-_" for letter in self.name):
            raise InputError(f"the picture name {self.name!r}", allowed="letters, digits, - and _")

    @property
    def rows(self) -> int:
        """Rows of panels."""
        return -(-len(self.panels) // self.columns)

    def place(self, index: int) -> tuple[int, int]:
        """Gives row and column of a panel, all counted from 0.

        Args:
            index: the panel.
        """
        return divmod(index, self.columns)

    def is_lowest(self, index: int) -> bool:
        """Says whether no panel stands below the panel at ``index``.

        Args:
            index: the panel, counted from 0.
        """
        return index + self.columns >= len(self.panels)


@dataclass(frozen=True, kw_only=True)
class LegendEntry:
    """One name of a picture's legend.

    Attributes:
        name: what is drawn so.
        colour: as ``#RRGGBB`` or ``rgba()``.
        shape: lines, steps, markers, bars, or area.
        dash: of a line.
    """

    name: str
    colour: str
    shape: str
    dash: str = "solid"


def legend_entries(picture: Picture) -> tuple[LegendEntry, ...]:
    """Lists each name of a picture once, as it is drawn first.

    Args:
        picture: with named series, stripes or bands.
    """
    entries: dict[str, LegendEntry] = {}
    for panel in picture.panels:
        for series in panel.series:
            entry = LegendEntry(
                name=series.name,
                colour=colour(series.role) if series.opacity else translucent(series.role, 0.4),
                shape=series.kind if series.opacity else "area",
                dash=series.dash,
            )
            entries.setdefault(series.name, entry)
        stripes: list[Span | Band] = [*panel.spans, *panel.bands]
        for stripe in stripes:
            entry = LegendEntry(name=stripe.label, colour=translucent(stripe.role, 0.4), shape="area")
            entries.setdefault(stripe.label, entry)
    entries.pop("", None)
    return tuple(entries.values())


def _vector(name: str, value: ArrayLike) -> Array:
    array = np.array(value, dtype=np.float64)
    if array.ndim != 1:
        raise InputError(f"shape {array.shape}", column=name, allowed="shape (N,)")
    array.setflags(write=False)
    return array


def _choice(name: str, value: str, allowed: tuple[str, ...]) -> None:
    if value not in allowed:
        raise InputError(f"found {value!r}", column=name, allowed=", ".join(allowed))


def _check_role(role: str) -> None:
    try:
        colour(role)
    except KeyError as error:
        raise InputError(
            f"the colour role {role!r} is unknown", allowed="a role of oed.reports.rendering.palette"
        ) from error

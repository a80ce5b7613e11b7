"""Pictures as plotly figures, for notebooks and pages."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from oed.reports.rendering.palette import GRID, INK, colour, translucent
from oed.reports.rendering.picture import Band, Panel, Picture, Series, Span
from oed.reports.rendering.thinning import POINTS, thin_indices
from robots.common.arrays import Array

if TYPE_CHECKING:
    # A page without pictures, and every other command, shall not wait for plotly.
    from plotly.graph_objects import Figure

MARGINS = {"l": 8, "r": 12, "t": 34, "b": 8}
ROW_GAP = 46
"""Space between rows of panels that share the x axis, for titles [px]."""

AXIS_GAP = 34
"""More space where each panel has an x axis of its own [px]."""

LABEL_SIZE = 11

DECADES = 300.0
"""Ratio of the values on a logarithmic axis up to which 1, 2 and 5 of each decade are written."""


def to_plotly(picture: Picture, *, points: int = POINTS) -> Figure:
    """Draws a picture with plotly.

    Colours of text, axes and grid suit light and dark backgrounds; the background is transparent.

    Args:
        picture: what to draw.
        points: how many points of a series may stay.

    Returns:
        The figure.
    """
    from plotly.graph_objects import Figure
    from plotly.subplots import make_subplots

    height, gap = height_of(picture)
    figure: Any = make_subplots(
        rows=picture.rows,
        cols=picture.columns,
        subplot_titles=[_escape(panel.title) for panel in picture.panels],
        specs=_cells(picture),
        vertical_spacing=min(gap / height, 0.9 / max(picture.rows - 1, 1)) if picture.rows > 1 else 0.0,
        horizontal_spacing=0.2 / picture.columns if picture.columns > 1 else 0.0,
        figure=Figure(layout={"template": "none"}),
    )
    titled = [index for index, panel in enumerate(picture.panels) if panel.title]
    for index, annotation in zip(titled, figure.layout.annotations, strict=True):
        annotation.update(font={"size": 13, "color": INK}, x=annotation.x, yshift=2, name=f"title-{index}")
    named: set[str] = set()
    # Handed over all at once: plotly copies and checks everything that is there with each single one.
    shapes: list[dict[str, Any]] = []
    notes: list[Any] = list(figure.layout.annotations)
    for index, panel in enumerate(picture.panels):
        row, column = (number + 1 for number in picture.place(index))
        for series in panel.series:
            for trace in _traces(series, panel, points, named):
                figure.add_trace(trace, row=row, col=column)
        _decorate(figure, panel, row, column, named, shapes, notes)
        _axes(figure, picture, index, row, column)
    has_legend = bool(named)
    figure.update_layout(
        shapes=shapes,
        annotations=notes,
        height=height + (30 if has_legend else 0),
        margin=MARGINS | {"t": MARGINS["t"] + (30 if has_legend else 0)},
        paper_bgcolor="rgba(0,0,0,0)",
        plot_bgcolor="rgba(0,0,0,0)",
        font={"color": INK, "size": 12, "family": "system-ui, 'Segoe UI', Roboto, 'Helvetica Neue', sans-serif"},
        showlegend=has_legend,
        legend={"orientation": "h", "yref": "container", "y": 1.0, "yanchor": "top", "x": 0.0, "xanchor": "left"},
        barmode="overlay",
        modebar={"bgcolor": "rgba(0,0,0,0)", "color": GRID, "activecolor": INK},
        hovermode="closest",
        hoverlabel={"namelength": -1},
    )
    return figure


def _cells(picture: Picture) -> list[list[dict[str, Any] | None]]:
    """Panels as cells of a grid; those after the last panel have no axes."""
    count = len(picture.panels)
    return [
        [{} if row * picture.columns + column < count else None for column in range(picture.columns)]
        for row in range(picture.rows)
    ]


def height_of(picture: Picture) -> tuple[int, int]:
    """Gives the height of a picture and the gap between its rows [px].

    Args:
        picture: with its rows and the length of its names.
    """
    gap = ROW_GAP + (0 if picture.shared_x else AXIS_GAP)
    longest = max((len(name) for panel in picture.panels for name in panel.categories), default=0)
    gap += min(5 * max(longest - 6, 0), 80)
    return picture.rows * picture.panel_height + (picture.rows - 1) * gap + 60 + gap - ROW_GAP, gap


def _traces(series: Series, panel: Panel, points: int, named: set[str]) -> list[dict[str, Any]]:
    chosen = np.arange(len(series.x)) if series.kind == "bars" else thin_indices(series.y, points)
    x, y = _compact(series.x[chosen]), _compact(series.y[chosen])
    error = None if series.error is None else _compact(series.error[chosen])
    trace: dict[str, Any] = {"x": x, "y": y, "opacity": series.opacity} | _legend(series.name, named)
    texts = [_escape(series.texts[index]) for index in chosen] if series.texts else None
    if texts is None and panel.categories and series.kind in ("bars", "markers"):
        texts = [_escape(panel.categories[round(value)]) for value in series.x[chosen]]
    if texts is not None:
        trace |= {"hovertext": texts, "hovertemplate": "%{hovertext}<br>%{y:.4g}"}
    if not series.opacity:
        trace["hoverinfo"] = "skip"
    elif series.name:
        hover = trace.get("hovertemplate", "%{x:.5g}, %{y:.5g}")
        trace["hovertemplate"] = f"{hover}<extra>{_escape(series.name)}</extra>"
    ink = colour(series.role)
    bars = {"type": "data", "array": error, "color": INK, "thickness": 1.2, "width": 3}
    if series.kind == "bars":
        offset, width = _slot(series, panel)
        trace |= {"type": "bar", "marker": {"color": ink}, "offset": offset, "width": width}
        return [trace | ({} if error is None else {"error_y": bars})]
    trace |= {"type": "scatter", "connectgaps": False}
    if series.kind == "markers":
        bars["color"] = ink
        trace |= {"mode": "markers", "marker": {"color": ink, "size": 4 if len(x) > 60 else 7}}
        return [trace | ({} if error is None else {"error_y": bars})]
    stroke = {"color": ink, "width": 1.4, "dash": series.dash, "shape": "hv" if series.kind == "steps" else "linear"}
    trace |= {"mode": "lines", "line": stroke}
    if error is None:
        return [trace]
    # The half widths are drawn by the ribbon; the line keeps them for the table of data.
    return [_ribbon(x, y, error, series), trace | {"error_y": {"type": "data", "array": error, "visible": False}}]


def _slot(series: Series, panel: Panel) -> tuple[float, float]:
    """Gives offset and width of a set of bars beside the others of its panel."""
    bars = [other for other in panel.series if other.kind == "bars"]
    width = panel.bar_group_width / len(bars)
    return (bars.index(series) - 0.5 * len(bars)) * width, width


def _ribbon(x: Array, y: Array, error: Array, series: Series) -> dict[str, Any]:
    known = np.isfinite(y) & np.isfinite(error)
    starts = np.flatnonzero(known & ~np.concatenate([[False], known[:-1]]))
    ends = np.flatnonzero(known & ~np.concatenate([known[1:], [False]])) + 1
    edge_x: list[Array] = []
    edge_y: list[Array] = []
    gap = np.array([np.nan])
    # One closed outline for each stretch without a gap.
    for start, end in zip(starts, ends, strict=True):
        part = slice(start, end)
        edge_x += [x[part], x[part][::-1], gap]
        edge_y += [(y - error)[part], (y + error)[part][::-1], gap]
    return {
        "type": "scatter",
        "x": np.concatenate(edge_x, dtype=np.float32) if edge_x else [],
        "y": np.concatenate(edge_y, dtype=np.float32) if edge_y else [],
        "fill": "toself",
        "fillcolor": translucent(series.role, 0.2),
        "line": {"width": 0},
        "mode": "lines",
        "hoverinfo": "skip",
        "showlegend": False,
        "legendgroup": series.name,
    }


def _legend(name: str, named: set[str]) -> dict[str, Any]:
    first = bool(name) and name not in named
    if first:
        named.add(name)
    return {"name": _escape(name), "legendgroup": name, "showlegend": first}


def _decorate(
    figure: Any,
    panel: Panel,
    row: int,
    column: int,
    named: set[str],
    shapes: list[dict[str, Any]],
    notes: list[Any],
) -> None:
    x_axis, y_axis = _axis_names(figure, row, column)
    upright = {"xref": x_axis, "yref": f"{y_axis} domain", "y0": 0, "y1": 1}
    level = {"xref": f"{x_axis} domain", "yref": y_axis, "x0": 0, "x1": 1}
    plain = {"type": "rect", "line": {"width": 0}}
    for span in panel.spans:
        fill = {"fillcolor": translucent(span.role, 0.13), "layer": "below"}
        shapes.append(plain | upright | fill | {"x0": span.start, "x1": span.end})
    for band in panel.bands:
        shapes.append(plain | level | {"fillcolor": translucent(band.role, 0.2), "y0": band.low, "y1": band.high})
    stripes: list[Span | Band] = [*panel.spans, *panel.bands]
    for stripe in stripes:
        if stripe.label and stripe.label not in named:
            key = {"symbol": "square", "size": 12, "color": translucent(stripe.role, 0.4)}
            entry = _legend(stripe.label, named) | {"mode": "markers", "marker": key, "hoverinfo": "skip"}
            figure.add_trace({"type": "scatter", "x": [None], "y": [None]} | entry, row=row, col=column)
    for line in panel.lines:
        stroke = {"color": colour(line.role), "width": 1.2, "dash": line.dash}
        shapes.append({"type": "line", "line": stroke} | level | {"y0": line.value, "y1": line.value})
        if line.label and _inside(line.value, panel.y_range):
            notes.append(
                {
                    "xref": f"{x_axis} domain",
                    "yref": y_axis,
                    "x": 1.0,
                    "y": np.log10(line.value) if panel.y_log else line.value,
                    "text": _escape(line.label),
                    "font": {"size": LABEL_SIZE, "color": INK},
                    "showarrow": False,
                    "xanchor": "right",
                    "yanchor": "bottom" if _labels_above(line.value, panel) else "top",
                    "borderpad": 0,
                }
            )
    if panel.note:
        notes.append(
            {
                "xref": f"{x_axis} domain",
                "yref": f"{y_axis} domain",
                "x": 1.0,
                "y": 1.0,
                "xanchor": "right",
                "yanchor": "top",
                "text": _escape(panel.note),
                "showarrow": False,
                "font": {"size": LABEL_SIZE, "color": INK},
            }
        )


def _labels_above(value: float, panel: Panel) -> bool:
    """Whether the label of a line stands above it: inside the panel, away from the data."""
    return value < 0.0 if panel.y_range is None else value < 0.5 * sum(panel.y_range)


def _inside(value: float, limits: tuple[float, float] | None) -> bool:
    return limits is None or limits[0] <= value <= limits[1]


def _axis_names(figure: Any, row: int, column: int) -> tuple[str, str]:
    axes = figure.get_subplot(row, column)
    return axes.yaxis.anchor, axes.xaxis.anchor


def _axes(figure: Any, picture: Picture, index: int, row: int, column: int) -> None:
    panel = picture.panels[index]
    common = {
        "gridcolor": GRID,
        "linecolor": INK,
        "zeroline": False,
        "automargin": True,
        "tickfont": {"size": LABEL_SIZE},
        "title_font": {"size": 12},
        "title_standoff": 6,
    }
    x_axis = common | {"type": "log" if panel.x_log else "linear", "showline": True, "ticks": "outside", "ticklen": 3}
    if not picture.shared_x or picture.is_lowest(index):
        x_axis["title_text"] = _escape(panel.x_label)
    else:
        x_axis["showticklabels"] = False
    if picture.shared_x and index:
        x_axis["matches"] = "x"
    if panel.categories:
        x_axis |= {"tickvals": list(range(len(panel.categories))), "showgrid": False}
        x_axis["ticktext"] = [_escape(name) for name in panel.categories]
    elif panel.x_log:
        x_axis |= _log_ticks([series.x for series in panel.series])
    y_axis = common | {"title_text": _escape(panel.y_label), "type": "log" if panel.y_log else "linear", "nticks": 6}
    if panel.y_log:
        y_axis |= _log_ticks([panel.y_range] if panel.y_range is not None else [series.y for series in panel.series])
    if panel.y_range is not None:
        y_axis["range"] = list(np.log10(panel.y_range)) if panel.y_log else list(panel.y_range)
    figure.update_xaxes(x_axis, row=row, col=column)
    figure.update_yaxes(y_axis, row=row, col=column)


def _log_ticks(shown: Sequence[ArrayLike]) -> dict[str, Any]:
    """Powers of ten over several decades, else 1, 2 and 5 with all digits: plotly writes 2 for 2000 between them."""
    values = np.concatenate([np.ravel(np.asarray(some, dtype=np.float64)) for some in (*shown, [np.nan])])
    values = values[np.isfinite(values) & (values > 0.0)]
    if not len(values) or values.max() > DECADES * values.min():
        return {"exponentformat": "power", "dtick": 1}
    powers = np.arange(np.floor(np.log10(values.min())), np.log10(values.max()) + 1)
    # Steps of 1 within a factor of two, so that two ticks at least are seen.
    digits = (1, 2, 5) if values.max() > 2.5 * values.min() else range(1, 10)
    ticks = [float(f"{digit}e{int(power)}") for power in powers for digit in digits]
    return {"tickvals": ticks, "ticktext": [f"{tick:.10g}" for tick in ticks]}


def _compact(values: Array) -> Array:
    # Seven digits are more than a screen shows, in half of the bytes.
    return values.astype(np.float32)


def _escape(text: str) -> str:
    """Plotly reads a small subset of HTML in its texts."""
    return text.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")

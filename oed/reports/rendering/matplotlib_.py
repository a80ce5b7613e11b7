"""Pictures as matplotlib figures, for PNG files and notebooks; the state of pyplot is not touched."""

from __future__ import annotations

from os import PathLike
from typing import TYPE_CHECKING, Any

from oed.reports.rendering.palette import colour
from oed.reports.rendering.picture import Panel, Picture, Series

if TYPE_CHECKING:
    # matplotlib takes a second to import; only those who draw shall wait for it.
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

PIXELS_PER_INCH = 100
WIDTH = {1: 9.0, 2: 11.0}
"""Width of a figure by its columns of panels [inch]; more columns: 4.2 each."""

STROKES = {"solid": "-", "dash": "--", "dot": ":"}


def to_matplotlib(picture: Picture, figure: Figure | None = None) -> Figure:
    """Draws a picture with matplotlib, outside of pyplot.

    Args:
        picture: what to draw.
        figure: an empty figure to draw in; by default a new one for the Agg renderer.

    Returns:
        The figure.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    if figure is None:
        width = WIDTH.get(picture.columns, 4.2 * picture.columns)
        height = picture.rows * (picture.panel_height + (45 if picture.shared_x else 75)) / PIXELS_PER_INCH + 0.9
        figure = Figure(figsize=(width, height), layout="constrained")
        FigureCanvasAgg(figure)
    figure.suptitle(picture.title, fontsize=12)
    grid = figure.subplots(picture.rows, picture.columns, squeeze=False, sharex="all" if picture.shared_x else "none")
    for index, axes in enumerate(grid.flat):
        if index >= len(picture.panels):
            axes.set_visible(False)
            continue
        _draw(axes, picture.panels[index], with_x=not picture.shared_x or picture.is_lowest(index))
        if picture.shared_x and picture.is_lowest(index):
            axes.tick_params(labelbottom=True)
    _legend(figure, grid.flat)
    return figure


def save_png(picture: Picture, path: str | PathLike[str], *, dpi: int = 150) -> None:
    """Draws a picture into a PNG file, which it replaces.

    Args:
        picture: what to draw.
        path: the file.
        dpi: pixels per inch.
    """
    to_matplotlib(picture).savefig(path, format="png", dpi=dpi, facecolor="white", metadata={"Software": None})


def _draw(axes: Axes, panel: Panel, *, with_x: bool) -> None:
    groups = [series for series in panel.series if series.kind == "bars"]
    for span in panel.spans:
        axes.axvspan(span.start, span.end, color=colour(span.role), alpha=0.13, linewidth=0, label=span.label or None)
    for band in panel.bands:
        axes.axhspan(band.low, band.high, color=colour(band.role), alpha=0.2, linewidth=0, label=band.label or None)
    for series in panel.series:
        if series.kind == "bars":
            _bars(axes, series, groups.index(series), panel.bar_group_width / len(groups), len(groups))
        else:
            _curve(axes, series)
    limits = panel.y_range
    for line in panel.lines:
        if limits is not None and not limits[0] <= line.value <= limits[1]:
            continue
        axes.axhline(line.value, color=colour(line.role), linestyle=STROKES[line.dash], linewidth=1.0)
        if line.label:
            below = line.value >= (0.0 if limits is None else 0.5 * sum(limits))
            axes.annotate(
                line.label,
                (1.0, line.value),
                xycoords=("axes fraction", "data"),
                xytext=(-2, -2 if below else 2),
                textcoords="offset points",
                ha="right",
                va="top" if below else "bottom",
                fontsize=7,
                color=colour(line.role),
            )
    _scales(axes, panel, with_x=with_x)


def _scales(axes: Axes, panel: Panel, *, with_x: bool) -> None:
    axes.set_title(panel.title, fontsize=9)
    axes.set_ylabel(panel.y_label, fontsize=8)
    if with_x:
        axes.set_xlabel(panel.x_label, fontsize=8)
    axes.tick_params(labelsize=7)
    axes.grid(visible=True, axis="y" if panel.categories else "both", color="#808891", alpha=0.25, linewidth=0.6)
    axes.set_axisbelow(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    if panel.categories:
        crowded = max(map(len, panel.categories)) * len(panel.categories) > 60
        axes.set_xticks(range(len(panel.categories)), panel.categories, rotation=60 if crowded else 0)
        if crowded:
            for label in axes.get_xticklabels():
                label.set(ha="right", rotation_mode="anchor")
        axes.set_xlim(-0.6, len(panel.categories) - 0.4)
    if panel.x_log:
        axes.set_xscale("log")
    if panel.y_log:
        axes.set_yscale("log")
    if panel.y_range is not None:
        axes.set_ylim(*panel.y_range)
    if panel.note:
        axes.text(0.99, 0.98, panel.note, transform=axes.transAxes, ha="right", va="top", fontsize=7, color="#5A626C")


def _bars(axes: Axes, series: Series, position: int, width: float, count: int) -> None:
    axes.bar(
        series.x + (position - 0.5 * (count - 1)) * width,
        series.y,
        width,
        yerr=series.error,
        color=colour(series.role),
        alpha=series.opacity,
        label=series.name or None,
        error_kw={"elinewidth": 0.9, "capsize": 1.5, "ecolor": "#5A626C"},
    )


def _curve(axes: Axes, series: Series) -> None:
    style: dict[str, Any] = {"color": colour(series.role), "alpha": series.opacity, "label": series.name or None}
    if series.kind == "markers":
        size = 2.0 if len(series.x) > 60 else 4.0
        axes.errorbar(series.x, series.y, yerr=series.error, fmt="o", markersize=size, elinewidth=0.9, **style)
        return
    if series.error is not None:
        low, high = series.y - series.error, series.y + series.error
        # A ribbon without a line of its own has the name.
        ribbon = None if series.opacity else series.name or None
        axes.fill_between(series.x, low, high, color=colour(series.role), alpha=0.2, linewidth=0, label=ribbon)
        if not series.opacity:
            return
    drawstyle = "steps-post" if series.kind == "steps" else "default"
    axes.plot(series.x, series.y, linestyle=STROKES[series.dash], linewidth=1.0, drawstyle=drawstyle, **style)


def _legend(figure: Figure, panels: Any) -> None:
    entries: dict[str, Any] = {}
    for axes in panels:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            entries.setdefault(label, handle)
    if entries:
        style: dict[str, Any] = {"loc": "outside lower center", "fontsize": 8, "frameon": False}
        figure.legend(entries.values(), entries.keys(), ncols=min(len(entries), 6), **style)

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path

import numpy as np
import plotly.graph_objects as go
import pytest
from matplotlib.figure import Figure
from PIL import Image

from oed.reports import Band, Line, Panel, Picture, Series, Span, save_png, to_matplotlib, to_plotly


@pytest.fixture
def everything() -> Picture:
    """One of each kind, with gaps, errors, logarithms and marks of every sort."""
    x = np.arange(1.0, 9.0)
    gap = np.where(x == 4, np.nan, x)
    kinds = tuple(
        Series(x=x, y=gap, error=error, name=f"{kind} {error is None}", kind=kind, dash="dot")
        for kind in ("lines", "markers", "bars", "steps")
        for error in (None, 0.1 * x)
    )
    marks = Panel(
        title="a < b & c",
        x_label="time [s]",
        y_label="torque [N m]",
        series=kinds,
        lines=(Line(value=3.0, label="limit"), Line(value=99.0, label="far")),
        bands=(Band(low=1.0, high=2.0, label="band"),),
        spans=(Span(start=1.0, end=2.0, label="span"),),
        y_range=(0.0, 10.0),
        note="note",
    )
    logs = Panel(series=kinds[:2], x_log=True, y_log=True, lines=(Line(value=10.0, label="ten"),), y_range=(0.1, 100.0))
    bars = Panel(series=(Series(x=[0, 1], y=[1, 2], kind="bars"),), categories=("a", "b"))
    return Picture(title="Everything", name="everything", panels=(marks, logs, bars), columns=2)


@pytest.mark.slow
def test_plotly_draws_every_kind(everything: Picture) -> None:
    """Each series becomes a trace of its kind, each name one entry of the legend, each text escaped."""
    figure = to_plotly(everything)
    assert isinstance(figure, go.Figure)
    assert sum(trace.type == "bar" for trace in figure.data) == 3
    assert {trace.line.shape for trace in figure.data if "lines" in (trace.to_plotly_json().get("mode") or "")} >= {
        "linear",
        "hv",
    }
    names = [trace.name for trace in figure.data if trace.showlegend]
    assert len(names) == len(set(names)) == 10
    texts = {annotation.text for annotation in figure.layout.annotations}
    assert {"a &lt; b &amp; c", "limit", "note", "ten"} <= texts
    assert "far" not in texts
    assert figure.layout.xaxis2.type == figure.layout.yaxis2.type == "log"
    assert figure.layout.yaxis2.range == pytest.approx((-1.0, 2.0))
    assert next(item.y for item in figure.layout.annotations if item.text == "ten") == 1.0
    assert figure.layout.xaxis3.ticktext == ("a", "b")


@pytest.mark.slow
def test_matplotlib_draws_every_kind(everything: Picture) -> None:
    """The same picture is drawn by matplotlib, in a figure of its own or in one that is given."""
    figure = to_matplotlib(everything)
    assert isinstance(figure, Figure)
    shown = [axes for axes in figure.axes if axes.get_visible()]
    assert [axes.get_title() for axes in shown] == ["a < b & c", "", ""]
    assert shown[1].get_xscale() == shown[1].get_yscale() == "log"
    mine = Figure()
    assert to_matplotlib(everything, mine) is mine


def test_bars_stand_side_by_side() -> None:
    """Bars of one position do not cover each other, in either library."""
    bars = tuple(Series(x=[0, 1, 2], y=[1, 2, 3], kind="bars", name=str(index)) for index in range(3))
    picture = Picture(title="t", name="t", panels=(Panel(series=bars, categories=("a", "b", "c")),))
    edges = [(trace.offset, trace.offset + trace.width) for trace in to_plotly(picture).data]
    patches = to_matplotlib(picture).axes[0].containers
    edges_there = [(group[0].get_x(), group[0].get_x() + group[0].get_width()) for group in patches]
    assert np.allclose(edges, edges_there, atol=1e-12)
    assert all(math.isclose(before[1], after[0]) for before, after in pairwise(edges))
    assert -0.5 < edges[0][0] < edges[-1][1] < 0.5


def test_long_series_are_thinned_without_losing_peaks() -> None:
    """A page holds few points of a long series, among them its extremes, to the seven digits of a float32."""
    y = np.random.default_rng(0).normal(size=50_000)
    picture = Picture(title="t", name="t", panels=(Panel(series=(Series(x=np.arange(50_000.0), y=y),)),))
    drawn = np.asarray(to_plotly(picture, points=500).data[0].y)
    assert len(drawn) <= 500
    assert drawn.max() == np.float32(y.max())
    assert drawn.min() == np.float32(y.min())


def test_shared_axes_zoom_together() -> None:
    """Panels that share the x axis follow the first, and only the lowest are labelled."""
    panel = Panel(x_label="time [s]", series=(Series(x=[0, 1], y=[0, 1]),))
    layout = to_plotly(Picture(title="t", name="t", panels=(panel,) * 4, columns=2, shared_x=True)).layout
    assert [layout[f"xaxis{index}"].matches for index in (2, 3, 4)] == ["x"] * 3
    assert [layout[name].title.text for name in ("xaxis", "xaxis2", "xaxis3", "xaxis4")] == [None, None] + [
        "time [s]"
    ] * 2


@pytest.mark.slow
def test_png_is_a_picture(everything: Picture, tmp_path: Path) -> None:
    """The PNG can be read, is not blank, and no figure of pyplot was opened or left."""
    import matplotlib.pyplot as plt

    before = plt.get_fignums()
    path = tmp_path / "picture.png"
    save_png(everything, path, dpi=60)
    with Image.open(path) as image:
        pixels = np.asarray(image.convert("L"))
    assert pixels.std() > 5
    assert min(pixels.shape) > 200
    assert plt.get_fignums() == before


def test_logarithmic_axes_write_whole_numbers() -> None:
    """Within a few decades ticks are 1, 2 and 5 with all digits; over many they are powers of ten."""
    narrow = Panel(x_log=True, series=(Series(x=np.array([210.0, 5800.0]), y=np.array([1.0, 2.0])),))
    wide = Panel(x_log=True, series=(Series(x=np.array([1.0, 1e6]), y=np.array([1.0, 2.0])),))
    drawn = to_plotly(Picture(title="p", name="p", panels=(narrow, wide), columns=2)).layout
    assert drawn.xaxis.ticktext[:6] == ("100", "200", "500", "1000", "2000", "5000")
    assert drawn.xaxis2.ticktext is None
    assert drawn.xaxis2.dtick == 1

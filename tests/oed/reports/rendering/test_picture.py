from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

from oed.reports import Band, Line, Panel, Picture, Series, Span
from robots.common.errors import InputError


def test_series_are_frozen_arrays() -> None:
    """A series holds its own read-only arrays."""
    x = np.arange(3.0)
    series = Series(x=x, y=[1, 2, 3])
    x[0] = 9
    assert series.x[0] == 0
    with pytest.raises(ValueError, match="read-only"):
        series.y[0] = 1


@pytest.mark.parametrize(
    "wrong",
    [{"y": [1.0]}, {"error": [1.0]}, {"texts": ("a",)}, {"kind": "pie"}, {"dash": "wavy"}, {"role": "x"}, {"x": [[1]]}],
)
def test_series_are_checked(wrong: dict[str, object]) -> None:
    """Lengths that differ and unknown choices are errors of ours."""
    with pytest.raises(InputError):
        Series(**({"x": [1.0, 2.0], "y": [1.0, 2.0]} | wrong))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "wrong", [{"panels": ()}, {"columns": 0}, {"name": "a/b"}, {"name": ""}], ids=["panels", "columns", "path", "empty"]
)
def test_pictures_are_checked(wrong: dict[str, object]) -> None:
    """A picture has panels, columns, and a name that is a file name."""
    with pytest.raises(InputError):
        Picture(**({"title": "t", "name": "a", "panels": (Panel(),)} | wrong))  # type: ignore[arg-type]


def test_unknown_roles_are_found_at_once() -> None:
    """Lines, bands and spans name known colours."""
    for build in (lambda: Line(value=0, role="x"), lambda: Band(low=0, high=1, role="x")):
        with pytest.raises(InputError, match="role"):
            build()
    with pytest.raises(InputError, match="role"):
        Span(start=0, end=1, role="x")


def test_places_of_panels() -> None:
    """Panels fill rows; those with nothing below carry the label of a shared axis."""
    picture = Picture(title="t", name="a", panels=(Panel(),) * 5, columns=3)
    assert picture.rows == 2
    assert picture.place(4) == (1, 1)
    assert [picture.is_lowest(index) for index in range(5)] == [False, False, True, True, True]


@pytest.mark.slow
def test_importing_reports_does_not_wait_for_drawing_libraries() -> None:
    """plotly, matplotlib and jinja2 are imported when something is drawn, not before."""
    code = "import sys, oed.reports; print(sorted({'plotly', 'matplotlib', 'jinja2'} & set(sys.modules)))"
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert result.stdout.strip() == "[]"

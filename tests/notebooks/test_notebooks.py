"""The notebooks run as they are in the repository.

They are scripts in jupytext's percent format, and a cell of it is plain Python: running the file runs every cell in
order in one process, without a kernel, which would add seconds and dependencies and hide a failure in another process.
"""

from __future__ import annotations

import runpy
from pathlib import Path

import matplotlib as mpl
import pytest

NOTEBOOKS = Path(__file__).parents[2] / "notebooks"
SCRIPTS = sorted(NOTEBOOKS.glob("*.py"))


@pytest.fixture(autouse=True)
def no_window():
    """Lets the notebooks draw without a screen, and closes what they drew."""
    before = mpl.get_backend()
    mpl.use("agg")
    yield
    import matplotlib.pyplot as plt

    plt.close("all")
    mpl.use(before)


@pytest.mark.slow
@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.stem)
@pytest.mark.filterwarnings("ignore:FigureCanvasAgg is non-interactive")
def test_notebook_runs(script):
    """Every notebook runs from its first cell to its last, without a warning."""
    runpy.run_path(str(script))


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.stem)
def test_notebook_is_paired(script):
    """Every notebook is a script that jupytext pairs with an .ipynb, and no output is kept beside it."""
    text = script.read_text(encoding="utf-8")
    assert "formats: ipynb,py:percent" in text
    assert text.count("# %% [markdown]") >= 3
    assert not script.with_suffix(".ipynb").exists() or "*.ipynb" in (NOTEBOOKS.parent / ".gitignore").read_text()


def test_there_is_a_first_tour():
    """The first tour is there."""
    assert NOTEBOOKS / "first_tour.py" in SCRIPTS

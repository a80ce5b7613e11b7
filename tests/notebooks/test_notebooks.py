"""The notebooks run as they are in the repository.

They are scripts in jupytext's percent format, and a cell of it is plain Python: running the file runs every cell in
order in one process, without a kernel, which would add seconds and dependencies and hide a failure in another process.
"""

from __future__ import annotations

import runpy
import sys
from pathlib import Path

import matplotlib as mpl
import pytest

from robots.terms.effects import EFFECTS
from tests.conftest import DATA
from tests.notebooks.claims import CLAIMS

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
def test_notebook_runs(script, tmp_path, monkeypatch):
    """Every notebook runs from an empty folder without a warning, ends with a picture, and keeps its claims."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [*sys.path])
    # Effects that a notebook registers must not be known to other tests.
    monkeypatch.setattr(EFFECTS, "_members", dict(EFFECTS._members))
    monkeypatch.setenv("OED_DATA", str(DATA))
    import matplotlib.pyplot as plt

    names = runpy.run_path(str(script))
    if names.get("available") is False:
        pytest.skip("the notebook's data or library is absent")
    assert plt.get_fignums(), "no picture"
    CLAIMS[script.stem](names)


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


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.stem)
def test_every_notebook_is_tested_and_listed(script):
    """Every notebook has claims that are tested, and a picture on its page of the documentation."""
    assert script.stem in CLAIMS
    page = (NOTEBOOKS.parent / "docs" / "notebooks.md").read_text(encoding="utf-8")
    assert f"notebooks/{script.name}" in page
    assert f"images/notebook_{script.stem}.png" in page


def test_real_data_may_be_absent(tmp_path, monkeypatch, capsys):
    """Without the data the notebook on the real robot says what to set, and does nothing else."""
    monkeypatch.setenv("OED_DATA", str(tmp_path))
    names = runpy.run_path(str(NOTEBOOKS / "real_robot.py"))
    assert names["available"] is False
    assert "OED_DATA" in capsys.readouterr().out

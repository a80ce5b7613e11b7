"""The page of all results, as text and in a real browser."""

from __future__ import annotations

from pathlib import Path

import pytest

from oed.overviews import Entry, find_results, overview_html
from tests.oed.overviews.test_entries import DESIGN, MODEL, write


def test_texts_are_escaped() -> None:
    """Names of files and robots cannot become markup or another address."""
    entry = Entry(path='a"><b/x#?.json', kind="model", robot="<i>", verdict="<script>alert(1)</script>", level="good")
    text = overview_html([entry], folder="<f>")
    assert "<script>alert" not in text
    assert "<i>" not in text
    assert "./a%22%3E%3Cb/x%23%3F.json" in text


def test_empty_folder() -> None:
    """Without results the page says what results are."""
    text = overview_html([], folder="empty")
    assert "This folder has no results." in text
    assert "design.json" in text


@pytest.mark.slow
def test_in_browser(browser, tmp_path: Path) -> None:
    """Sorted by a column, filtered by robot, two side by side, narrow and wide, and readable without scripts."""
    for number, cond in enumerate((300.0, 40.0)):
        write(tmp_path, f"{number}/design.json", DESIGN | {"quality": [{"samples": 2500, "cond_Y": cond}]})
    write(tmp_path, "m/model.json", MODEL)
    path = tmp_path / "index.html"
    path.write_text(overview_html(find_results(tmp_path), folder="results"))
    for width, dark in ((390, True), (1280, False)):
        browser.open(path, width=width, dark=dark)
        assert browser.run("document.documentElement.scrollWidth") <= width
    shown = "[...document.querySelectorAll('.results tbody tr:not([hidden]) .path')]"
    files = f"{shown}.map((cell) => cell.textContent.trim())"
    browser.run("document.querySelectorAll('.results th button')[6].click()")
    assert browser.run(files) == ["0/design.json", "1/design.json", "m/model.json"]
    browser.run("document.querySelectorAll('.results th button')[6].click()")
    assert browser.run(files) == ["m/model.json", "1/design.json", "0/design.json"]
    browser.run("document.getElementById('robot').value = 'er3a'")
    browser.run("document.getElementById('robot').dispatchEvent(new Event('input'))")
    assert browser.run(files) == ["1/design.json", "0/design.json"]
    assert browser.run("document.getElementById('compare').disabled")
    browser.run("document.querySelectorAll('.results tr:not([hidden]) input').forEach((box) => box.click())")
    browser.run("document.getElementById('compare').click()")
    lines = browser.run(
        "[...document.querySelectorAll('#side tr')].map((row) => [...row.cells].map((c) => c.textContent))"
    )
    assert lines[0] == ["", "1/design.json", "0/design.json"]
    assert ["cond(Y)", "40.00", "300.0"] in lines
    assert browser.problems == []
    browser.open(path, width=390, scripts=False)
    browser.scripts(allowed=True)
    assert "m/model.json" in browser.run("document.body.innerText")

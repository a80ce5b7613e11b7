"""The page on the benchmark is in step with the code, and its example is valid."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from oed.benchmarks import read_answers, score_benchmark
from oed.benchmarks.making.strata import SHARES
from oed.benchmarks.rivals.residual_fit import LEAST_RESIDUAL_SHARE
from oed.benchmarks.rivals.threshold import NOISE_FACTOR
from oed.benchmarks.taxonomy import CLASSES, PARAMETERS

PAGE = (Path(__file__).parents[3] / "docs" / "benchmark.md").read_text(encoding="utf-8")


def test_the_example_is_a_file_of_answers(blind, tmp_path: Path):
    """The documented answers are read without a complaint and scored; the fourth case is missing."""
    text = re.search(r"^```json\n(.*?)^```$", PAGE, flags=re.MULTILINE | re.DOTALL)
    assert text is not None
    path = tmp_path / "answers.json"
    path.write_text(text[1])
    (tmp_path / "predictions").mkdir()
    table = np.ones((blind.case("case-001").unseen_rows, 2))
    np.savetxt(tmp_path / "predictions" / "case-001.csv", table, delimiter=",", header="tau1,tau2", comments="")
    answers = read_answers(path, blind)
    assert [answers.cases[name].verdict for name in blind.cases[:3]] == ["nothing", "effects", "unexplained"]
    (tool,) = score_benchmark(blind.folder, [path]).tools
    assert tool.missing == ("case-004",)
    titles = re.findall(r"^\| ([^|]+) \|", PAGE.split("## Scores")[1], flags=re.MULTILINE)
    assert set(tool.figures) <= set(titles)


def test_tables_are_those_of_the_code():
    """Classes, exact names, parameters, units, strata and limits on the page are those that the code has."""
    rows = re.findall(r"^\| `(\w+)` \| (.*?) \| (.*?) \|$", PAGE.split("### Parameters")[0], flags=re.MULTILINE)
    classes = {name: tuple(re.findall(r"`(\w+)`", names)) for name, names, _ in rows if name in CLASSES}
    assert classes == {name: group.effects for name, group in CLASSES.items()}
    assert {name: text for name, _, text in rows if name in CLASSES} == {n: g.meaning for n, g in CLASSES.items()}
    stated = re.findall(r"^\| `(\w+)` \| ([^|]+) \| ([^|]+) \| (.*) \|$", PAGE, flags=re.MULTILINE)
    parameters = {
        name: (unit, tuple(re.findall(r"`(\w+)`", effects)), text.replace("\\|", "|"))
        for name, unit, effects, text in stated
        if name in PARAMETERS
    }
    assert parameters == {name: (p.unit, p.effects, p.meaning) for name, p in PARAMETERS.items()}
    shares = re.findall(r"^\| (\w+) \| (\d+) % \|", PAGE, flags=re.MULTILINE)
    assert {name: int(share) / 100 for name, share in shares} == SHARES
    assert f"more than {NOISE_FACTOR:g} times" in PAGE
    assert f"at least {100 * LEAST_RESIDUAL_SHARE:g} %" in PAGE

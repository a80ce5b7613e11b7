"""Scores of answers whose right score is known."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.stats import binomtest

from oed.benchmarks import score_benchmark
from oed.benchmarks.scores.rates import Median, Rate

RIGHT: dict[str, Any] = {
    "case-001": {"verdict": "nothing"},
    "case-002": {
        "verdict": "effects",
        "effects": [
            {
                "effect": "stribeck",
                "joints": [2],
                "confidence": 0.9,
                "parameters": {"stribeck_velocity": {"value": 0.11, "interval": [0.09, 0.13]}},
            }
        ],
    },
    "case-003": {
        "verdict": "effects",
        "effects": [
            {
                "effect": "payload",
                "joints": [],
                "parameters": {"change_time": {"value": 3.5, "interval": [3.4, 3.6]}},
            },
            {"effect": "spring", "joints": [1]},
        ],
    },
    "case-004": {"verdict": "unexplained", "effects": [{"effect": "unknown", "joints": [1]}]},
}


def figures(blind, *paths: Path) -> list[dict[str, Any]]:
    """The figures of each tool as hits and cases."""
    scores = score_benchmark(blind.folder, paths).to_dict()
    json.dumps(scores, allow_nan=False)
    return [
        {title: (f.get("hits"), f["cases"]) for title, f in tool["figures"].items() if "cases" in f}
        for tool in scores["tools"]
    ]


def test_right_answers_score_fully(blind, write):
    """Right answers count in every rate; a class counts as such and not as a name."""
    (found,) = figures(blind, write(RIGHT))
    assert found["false alarm"] == (0, 1)
    assert found["detected"] == (3, 3)
    for level in ("detected", "joint", "class and joint", "name and joint"):
        assert found[f"one effect: {level}"] == (1, 1)
    assert found["two effects: both, by class"] == (1, 1)
    assert found["two effects: both, by name"] == (0, 1)
    assert found["one or two: a spurious effect"] == (0, 2)
    assert found["outside: unexplained"] == (1, 1)
    assert found["outside: wrongly named"] == (0, 1)
    # The interval of the payload does not count: its class was given, not its name.
    assert found["intervals with the true value"] == (1, 1)


def test_wrong_answers_do_not(blind, write):
    """An alarm on an empty case, a wrong joint, a wrong class, one of two, and a name outside the catalogue."""
    cases = {
        "case-001": {"verdict": "unexplained"},
        "case-002": {"verdict": "effects", "effects": [{"effect": "friction", "joints": [1]}]},
        "case-003": {
            "verdict": "effects",
            "effects": [{"effect": "spring", "joints": [1]}, {"effect": "ripple", "joints": [1]}],
        },
        "case-004": {"verdict": "effects", "effects": [{"effect": "spring", "joints": [1]}]},
    }
    (found,) = figures(blind, write(cases))
    assert found["false alarm"] == (1, 1)
    assert found["one effect: detected"] == (1, 1)
    assert found["one effect: joint"] == (0, 1)
    assert found["one effect: class and joint"] == (0, 1)
    assert found["two effects: one of them"] == (1, 1)
    assert found["two effects: both, by class"] == (0, 1)
    assert found["one or two: a spurious effect"] == (2, 2)
    assert found["outside: unexplained"] == (0, 1)
    assert found["outside: wrongly named"] == (1, 1)


def test_one_answer_counts_for_one_effect(blind, write):
    """The first effect alone decides joint and class of a single effect, and listing all joints is no joint."""
    everything = [{"effect": "friction", "joints": [1]}, {"effect": "stribeck", "joints": [2]}]
    both = [{"effect": "stribeck", "joints": [1, 2]}]
    for listed in (everything, both):
        (found,) = figures(blind, write({"case-002": {"verdict": "effects", "effects": listed}}))
        assert found["one effect: joint"] == (0, 1)


def test_missing_cases_count_as_wrong(blind, write):
    """A case without an answer is an alarm where nothing is hidden, a miss elsewhere, and the summary lists it."""
    path = write({})
    (found,) = figures(blind, path)
    assert found["false alarm"] == (1, 1)
    assert found["detected"] == (0, 3)
    assert found["outside: unexplained"] == (0, 1)
    assert "4 cases are missing and count as wrong: case-001" in score_benchmark(blind.folder, [path]).summary()


def test_errors_are_over_the_noise(blind, write, predict):
    """A prediction that is off by twice the noise on one joint and right on the other has the error sqrt(2)."""
    torque = np.ones((400, 2))
    torque[:, 0] += 2 * 0.5
    # The first and last half second do not count.
    torque[:50] = torque[-50:] = 1e6
    path = write({"case-001": {"verdict": "nothing", "predicted_torque": predict(torque)}})
    scores = score_benchmark(blind.folder, [path])
    found = scores.tools[0].figures["prediction error over noise"]
    assert found.value == pytest.approx(np.sqrt(2.0))
    assert scores.tools[0].unpredicted == 3


def test_tools_stand_side_by_side(blind, write):
    """Several answers make one table with a column each, and tools of one name are numbered."""
    silent = {name: {"verdict": "nothing"} for name in blind.cases}
    paths = [write(RIGHT, "a|b"), write(silent, "silent")]
    scores = score_benchmark(blind.folder, [*paths, paths[1]])
    assert [tool.tool for tool in scores.tools] == ["a|b", "silent", "silent (2)"]
    lines = scores.markdown().splitlines()
    assert lines[0] == "|  | a\\|b | silent | silent (2) |"
    assert lines[2].startswith("| false alarm | 0 of 1 (0 to 98 %) | 0 of 1")
    assert len({line.replace("\\|", "").count("|") for line in lines if line.startswith("|")}) == 1
    assert scores.summary().splitlines()[1].split()[0] == "false"


def test_confidences_have_a_brier_score(blind, write):
    """A right effect with the confidence 0.9 has the score 0.01, and tools without confidences have no such row."""
    scored, silent = score_benchmark(blind.folder, [write(RIGHT), write({}, "silent")]).tools
    assert scored.figures["Brier score of confidences"].value == pytest.approx(0.01)
    assert "Brier score of confidences" not in silent.figures


@pytest.mark.parametrize(("hits", "tries"), [(0, 7), (3, 9), (12, 12), (1, 150)])
def test_intervals_of_rates_are_exact(hits: int, tries: int):
    """Rates have the Clopper-Pearson interval."""
    wanted = binomtest(hits, tries).proportion_ci(0.95, method="exact")
    assert Rate(hits=hits, tries=tries).interval == pytest.approx((wanted.low, wanted.high))


def test_intervals_of_medians_hold_for_any_distribution():
    """Of 20 values the sixth and the fifteenth bound the median at 95 % (95.9 %), and five values have no bounds."""
    assert Median(values=tuple(map(float, range(1, 21)))).interval == (6.0, 15.0)
    assert Median(values=(1.0, 2.0, 3.0, 4.0, 5.0)).interval is None

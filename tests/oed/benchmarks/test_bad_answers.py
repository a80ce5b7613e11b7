"""Every mistake in a benchmark, its sealed answers, or a file of answers is one message."""

from __future__ import annotations

import json
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from oed.benchmarks import read_answers, read_benchmark, score_benchmark
from oed.benchmarks.answers import Answers, CaseAnswer, NamedEffect, StatedValue, write_answers
from oed.benchmarks.folders import default_sealed
from robots.common.errors import InputError
from robots.common.files import ResultFolder


def effects(**entry: Any) -> dict[str, Any]:
    """Cases; the second one names one effect."""
    return {"case-002": {"verdict": "effects", "effects": [{"effect": "stribeck", "joints": [2]} | entry]}}


@pytest.mark.parametrize(
    ("cases", "message"),
    [
        ([], "cases: found list"),
        ({"case-9": {"verdict": "nothing"}}, r"cases\.case-9: the benchmark has no such case.*case-001 to case-004"),
        ({"case-001": "nothing"}, r"cases\.case-001: found 'nothing'"),
        ({"case-001": {}}, "no key verdict"),
        ({"case-001": {"verdict": "none"}}, "found 'none'; allowed: nothing, effects, unexplained"),
        ({"case-001": {"verdict": "nothing", "efects": []}}, "unknown key efects"),
        ({"case-001": {"verdict": "nothing", "effects": [{"effect": "spring"}]}}, "beside the verdict 'nothing'"),
        ({"case-001": {"verdict": "effects"}}, "no effect beside the verdict 'effects'"),
        ({"case-001": {"verdict": "nothing", "effects": {}}}, "allowed: a list"),
        ({"case-001": {"verdict": "nothing", "predicted_torque": 3}}, "path of a CSV"),
        ({"case-001": {"verdict": "nothing", "predicted_torque": "no.csv"}}, "no.csv: no such file"),
        (effects(effect="stribek"), r"effects\[1\]\.effect: no effect is called 'stribek'; did you mean stribeck"),
        (effects(joints=[0]), "a list of joints from 1 to 2"),
        (effects(joints=2), "a list of joints from 1 to 2"),
        (effects(joints=[True]), "a list of joints from 1 to 2"),
        (effects(confidence=1.5), "confidence: found 1.5; allowed: 0 to 1"),
        (effects(parameters=[]), "parameters: found"),
        (effects(parameters={"velocity": {"value": 1}}), "velocity: no such parameter; allowed: stribeck_velocity"),
        (effects(parameters={"mass": {}}), "no key value"),
        (effects(parameters={"mass": {"value": "1"}}), "allowed: a finite number"),
        (effects(parameters={"mass": {"value": 1, "interval": [2, 1]}}), "allowed: .lower, upper."),
        (effects(parameters={"mass": {"value": 1, "interval": [0, None]}}), "allowed: .lower, upper."),
    ],
)
def test_entries(blind, write, cases: Any, message: str):
    """A wrong entry is named by its path in the file, with what is allowed."""
    with pytest.raises(InputError, match=message):
        read_answers(write(cases), blind)


@pytest.mark.parametrize(
    ("other", "message"),
    [
        ({"benchmark": "f" * 16}, "answers another benchmark"),
        ({"format": "answers"}, "is not an oed-benchmark-answers file"),
        ({"format_version": 2}, "format version 2; allowed: up to 1"),
        ({"tool": "mine"}, "tool: found 'mine'"),
        ({"seed": 1}, "unknown key seed"),
    ],
)
def test_heads(blind, write, other: dict[str, Any], message: str):
    """So is a wrong head of the file."""
    with pytest.raises(InputError, match=message):
        read_answers(write({}, **other), blind)


def test_no_json(blind, tmp_path: Path):
    """A file that is no JSON says so."""
    (tmp_path / "broken.json").write_text("{")
    with pytest.raises(InputError, match="is not an oed-benchmark-answers file"):
        read_answers(tmp_path / "broken.json", blind)


@pytest.mark.parametrize(
    ("torque", "message"),
    [
        (np.ones((399, 2)), "399 rows; allowed: 400, one per row of case-001/unseen.csv"),
        (np.ones((400, 1)), "column tau2: no such column"),
        (np.where(np.arange(800).reshape(400, 2) == 7, np.nan, 1.0), "column tau2, row 5: nan is not a finite number"),
        (np.where(np.arange(800).reshape(400, 2) == 6, np.inf, 1.0), "column tau1, row 5: inf is not a finite number"),
    ],
)
def test_predictions(blind, write, predict, torque: np.ndarray, message: str):
    """A prediction has one finite value per row and joint."""
    path = write({"case-001": {"verdict": "nothing", "predicted_torque": predict(torque)}})
    with pytest.raises(InputError, match=message):
        read_answers(path, blind)


def test_folder_without_a_benchmark(tmp_path: Path):
    """Another folder is no benchmark, and says what makes one."""
    with pytest.raises(InputError, match=r"is no benchmark: it has no benchmark\.json"):
        read_benchmark(tmp_path)


def test_changed_answers_are_refused(blind, write):
    """Sealed answers with another content than at first do not have the hash that the folder states."""
    sealed = default_sealed(blind.folder)
    with zipfile.ZipFile(sealed) as archive:
        content = {name: archive.read(name) for name in archive.namelist()}
    data = json.loads(content["answers.json"])
    data["cases"]["case-001"]["stratum"] = "one"
    with zipfile.ZipFile(sealed, "w") as archive:
        for name, text in (content | {"answers.json": json.dumps(data).encode()}).items():
            archive.writestr(name, text)
    with pytest.raises(InputError, match="was changed after the benchmark was made"):
        score_benchmark(blind.folder, [write({})])


def test_answers_of_another_benchmark_are_refused(blind, write):
    """The message says whose answers they are, not that they were changed."""
    manifest = blind.folder / "benchmark.json"
    manifest.write_text(manifest.read_text().replace(blind.identity, "e" * 16))
    with pytest.raises(InputError, match="holds the answers of another benchmark"):
        score_benchmark(blind.folder, [write({})])


def test_damaged_and_missing_answers(blind, write):
    """A file that is no archive, and one that is not there."""
    sealed = default_sealed(blind.folder)
    sealed.write_bytes(b"PK")
    with pytest.raises(InputError, match="is no file of sealed answers"):
        score_benchmark(blind.folder, [write({})])
    sealed.unlink()
    with pytest.raises(InputError, match="no such file"):
        score_benchmark(blind.folder, [write({})])
    with pytest.raises(InputError, match="no answers to score"):
        score_benchmark(blind.folder, [])


def test_answers_survive_writing_and_reading(blind, tmp_path: Path):
    """What is written is read back: verdict, effects, parameters, intervals, confidence and prediction."""
    effect = NamedEffect(
        effect="stribeck",
        joints=(2,),
        parameters={"stribeck_velocity": StatedValue(value=0.1, interval=(0.05, 0.2))},
        confidence=0.5,
    )
    torque = np.arange(800.0).reshape(400, 2) / 7
    case = CaseAnswer(verdict="effects", effects=(effect,), torque=torque)
    answers = Answers(tool="mine", version="2", benchmark=blind.identity, cases={"case-002": case})
    with ResultFolder(tmp_path / "out") as out:
        write_answers(out, answers)
    read = read_answers(tmp_path / "out", blind)
    assert (read.tool, read.version, set(read.cases)) == ("mine", "2", {"case-002"})
    assert read.cases["case-002"].effects == (effect,)
    np.testing.assert_allclose(read.cases["case-002"].torque, torque, rtol=1e-8)

"""Results in a folder: one entry a file, also of broken, foreign and old files."""

from __future__ import annotations

import json
import os
import time
from pathlib import Path

import numpy as np
import pytest

from estimation.payloads.body import Body
from estimation.payloads.result import PayloadEstimate
from oed.overviews import find_results
from robots.common.errors import InputError
from robots.common.records import severity
from tests.oed.reports.pages.test_pages_in_browser import monitored, payload
from tests.oed.test_loading import calibrated, fleet

DESIGN = {
    "format": "robot-oed design",
    "format_version": 1,
    "robot": {"name": "er3a"},
    "quality": [{"samples": 100, "cond_Y": 50.0}, {"samples": 2500, "cond_Y": 160.0}],
    "duration": 23.7,
    "smallest_margins": [
        {"limit": 2.0, "slack_fraction": 0.05},
        {"limit": None, "slack_fraction": 0.01},
    ],
    "conclusion": "Play trajectory.csv on the robot.",
    "remarks": [],
}
MODEL = {
    "format": "robot-oed model",
    "format_version": 1,
    "robot": {"name": "ur10"},
    "parameters": [{"determined": True}, {"determined": False}],
    "covariance": [[1.5e-3] * 60] * 60,
    "provenance": {"logs": [{"samples": 100}], "method": "wls", "unseen_nrmse": [0.03, 0.04, None]},
}
DIAGNOSIS = {
    "verdict": "named",
    "findings": [{"effect": "friction_step", "joint": 4}],
    "baseline": {"nrmse": [0.3, 0.4]},
    "extended": {"nrmse": [0.06, 0.08]},
    "explained": 0.9,
    "conclusion": "Inspect joint 4.",
    "remarks": [{"code": "effect.fault", "text": "Friction of joint 4 rose."}],
}


def write(folder: Path, name: str, content: object) -> Path:
    path = folder / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(content if isinstance(content, str) else json.dumps(content), encoding="utf-8")
    return path


def by_path(folder: Path) -> dict:
    return {entry.path: entry for entry in find_results(folder)}


def test_figures_come_from_the_files(tmp_path: Path) -> None:
    """A design, a model and a diagnosis give kind, robot, urgency and key figures."""
    write(tmp_path, "a/design.json", DESIGN)
    write(tmp_path, "b/model.json", MODEL)
    write(tmp_path, "c/diagnosis.json", DIAGNOSIS)
    found = by_path(tmp_path)
    design, model, diagnosis = (found[p] for p in ("a/design.json", "b/model.json", "c/diagnosis.json"))
    assert (design.kind, design.robot, design.level) == ("design", "er3a", "good")
    assert design.figures["cond(Y)"] == 160.0
    assert design.figures["tightest limit [% left]"] == pytest.approx(5.0)
    assert (model.robot, model.level) == ("ur10", "note")
    # The root mean square of 3 and 4 %.
    assert model.figures["NRMSE, held-out data [%]"] == pytest.approx(12.5**0.5)
    assert (diagnosis.level, diagnosis.verdict) == ("act", "Inspect joint 4.")
    assert diagnosis.figures["NRMSE, base model [%]"] == pytest.approx(100 * (0.125**0.5))


def test_a_result_says_what_its_file_says(tmp_path: Path) -> None:
    """Verdict and urgency are the conclusion and the most urgent remark of the file, in the result's own words."""
    for make in (monitored, payload, fleet, calibrated):
        result = make()
        result.save(tmp_path, force=True)
        entry = by_path(tmp_path)[result.FILE]
        assert entry.verdict == result.conclusion
        assert entry.level == severity(remark.code for remark in result.remarks)
        assert entry.figures


def test_reports_have_the_last_word(tmp_path: Path) -> None:
    """Urgency and verdict are those of the report of the folder, for the result that the report is about."""
    head = '<meta name="oed:urgency" content="act">\n<meta name="oed:verdict" content="Inspect joint 2 &amp; 3.">'
    write(tmp_path, "d/report.html", f"<html>{head}")
    write(tmp_path, "d/diagnosis.json", DIAGNOSIS | {"verdict": "none", "findings": [], "remarks": []})
    write(tmp_path, "d/model.json", MODEL)
    found = by_path(tmp_path)
    assert found["d/diagnosis.json"].verdict == "Inspect joint 2 & 3."
    assert (found["d/diagnosis.json"].level, found["d/diagnosis.json"].report) == ("act", "d/report.html")
    assert (found["d/model.json"].level, found["d/model.json"].report) == ("note", "")


def test_old_reports_have_links_only(tmp_path: Path) -> None:
    """A report that does not state its verdict is linked, and the verdict comes from the data."""
    write(tmp_path, "report.html", "<html><p>old</p>")
    write(tmp_path, "model.json", MODEL)
    (entry,) = find_results(tmp_path)
    assert entry.report == "report.html"
    assert entry.verdict == "2 parameters, 1 not determined."


@pytest.mark.parametrize(
    ("name", "content", "kind", "text"),
    [
        ("design.json", "{", "unreadable", "no whole JSON file"),
        ("model.json", "[1, 2", "unreadable", "no whole JSON file"),
        ("model.json", "", "unreadable", "no whole JSON file"),
        ("model.json", "[" * 100_000, "unreadable", "no whole JSON file"),
        ("design.json", {"format": "robot-oed design"}, "other version", "'remarks' is missing"),
        ("model.json", MODEL | {"parameters": 3}, "other version", "another form"),
        ("x.json", {"format": "robot-oed telepathy"}, "telepathy", "No summary"),
        ("diagnosis.json", {"verdict": "none", "findings": []}, "other version", "'remarks' is missing"),
    ],
)
def test_bad_files_have_their_row(tmp_path: Path, name: str, content: object, kind: str, text: str) -> None:
    """Broken JSON, a field that is missing or of another form, a kind of tomorrow: a row that says so."""
    write(tmp_path, name, content)
    (entry,) = find_results(tmp_path)
    assert entry.kind == kind
    assert text in entry.verdict


@pytest.mark.parametrize("content", ["[1]", "{}", '{"format": 3}', '{"format": "other"}', "null"])
def test_foreign_files_have_none(tmp_path: Path, content: str) -> None:
    """JSON of other programs, logs and hidden folders are not listed."""
    write(tmp_path, "package.json", content)
    write(tmp_path, "diagnosis.json", "{}")
    write(tmp_path, ".hidden/design.json", DESIGN)
    write(tmp_path, "log.csv", "t,q1\n")
    assert find_results(tmp_path) == ()


def test_a_payload_that_is_not_there_is_good_news(tmp_path: Path) -> None:
    """A file without a payload has its bound as the verdict, and open quantities are no doubt."""
    body = Body(np.zeros(10))
    spread = (0.0123 / 1.96) ** 2 * np.eye(10)
    result = PayloadEstimate(
        robot="ur10",
        method="model",
        body=body,
        nearest=np.zeros(10),
        values=np.zeros(10),
        covariance=spread,
        joints=(),
        rows=9,
    )
    result.save(tmp_path)
    (entry,) = find_results(tmp_path)
    assert (entry.verdict, entry.level) == (f"No payload was found: {result.limit}.", "good")
    assert entry.verdict == result.conclusion == "No payload was found: at most 0.012 kg at 95 %."


def test_robots_are_listed(tmp_path: Path) -> None:
    """Robot files in YAML and URDF are rows with the robot's name; other YAML files are not."""
    write(tmp_path, "arm.yaml", "name: my arm  # of the cell\nurdf: arm.urdf\n")
    write(tmp_path, "arm.urdf", '<?xml version="1.0"?>\n<robot\n name="arm6"><link/></robot>')
    write(tmp_path, "mapping.yaml", "name: columns\nt: time\n")
    assert {entry.path: entry.robot for entry in find_results(tmp_path)} == {"arm.yaml": "my arm", "arm.urdf": "arm6"}


def test_links_out_of_the_folder_are_left_out(tmp_path: Path) -> None:
    """A link to a file or folder outside is not read."""
    write(tmp_path, "outside/design.json", DESIGN)
    inside = tmp_path / "inside"
    inside.mkdir()
    os.symlink(tmp_path / "outside", inside / "folder")
    os.symlink(tmp_path / "outside" / "design.json", inside / "design.json")
    os.symlink(inside, inside / "loop")
    assert find_results(inside) == ()


def test_folders_that_are_none(tmp_path: Path) -> None:
    """A folder that is not there, and a file in its place, are named."""
    with pytest.raises(InputError, match="no such folder"):
        find_results(tmp_path / "none")
    with pytest.raises(InputError, match="a file, not a folder"):
        find_results(write(tmp_path, "a.txt", "x"))


def test_long_arrays_do_not_matter(tmp_path: Path) -> None:
    """A model with a covariance of a megabyte reads as without, also where a text looks like an array."""
    large = {"a": "[1, 2" + " " * 200_000, "b": "[3]]", "covariance": [[0.25] * 300] * 300}
    write(tmp_path, "large/model.json", large | MODEL | {"covariance": large["covariance"]})
    write(tmp_path, "small/model.json", MODEL | {"covariance": []})
    large_entry, small_entry = (by_path(tmp_path)[f"{size}/model.json"] for size in ("large", "small"))
    assert (large_entry.verdict, large_entry.figures) == (small_entry.verdict, small_entry.figures)


@pytest.mark.slow
def test_many_results_are_read_at_once(tmp_path: Path) -> None:
    """A thousand results are read in about a second; the bound leaves room for a busy machine."""
    for number in range(500):
        write(tmp_path, f"{number}/model.json", MODEL)
        write(tmp_path, f"{number}/design.json", DESIGN)
    start = time.process_time()
    assert len(find_results(tmp_path)) == 1000
    assert time.process_time() - start < 3.0

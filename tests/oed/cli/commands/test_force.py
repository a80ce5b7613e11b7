"""``oed force`` from the command line: results, and bad input with one message each."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow


def test_files_are_written_and_a_calibration_is_taken(run, experiment: Path, tmp_path: Path) -> None:
    """forces.csv, forces.json and report.html; no contact in a log without one; the calibration serves another run."""
    out = tmp_path / "out"
    command = ("force", "--model", experiment, "--log", experiment / "log.csv", "--out")
    done = run(*command, out, "--json")
    assert done.code == 0, done.err
    assert {file.name for file in out.iterdir()} == {"forces.csv", "forces.json", "report.html"}
    assert done.data["contacts"] == []
    assert json.loads((out / "forces.json").read_text())["calibration"] == done.data["calibration"]
    assert "No contact was found" in (out / "report.html").read_text()
    assert run(*command, out).code == 2
    again = run(*command, tmp_path / "again", "--calibration", out)
    assert again.code == 0, again.err
    assert again.out.startswith("no contact in")


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--healthy", "LOG", "--calibration", "LOG"), "--healthy and --calibration together"),
        (("--calibration", "LOG"), "give a forces.json"),
        (("--calibration", "nowhere"), "nowhere"),
        (("--velocity", "logged"), "dq1"),
        (("--velocity", "fast"), "smoothed or logged"),
        (("--c-code", "observer.c"), "--velocity logged"),
        (("--false-alarms-per-hour", "0"), "positive"),
        (("--bandwidth", "-1"), "bandwidth"),
        (("--tool", "1,2"), "x, y, z"),
        (("--ambient", "20"), "no thermal part"),
    ],
)
def test_bad_options_end_with_one_message_and_no_folder(
    run, experiment: Path, tmp_path: Path, options: tuple, words: str
) -> None:
    """Exit code 2, one line, and nothing written."""
    log, out = experiment / "log.csv", tmp_path / "out"
    chosen = [log if option == "LOG" else option for option in options]
    if "observer.c" in chosen:
        chosen[-1] = tmp_path / "observer.c"
    done = run("force", "--model", experiment, "--log", log, *chosen, "--out", out)
    assert done.code == 2, done.out
    assert words in done.err
    assert "Traceback" not in done.err
    assert not out.exists()
    assert not (tmp_path / "observer.c").exists()

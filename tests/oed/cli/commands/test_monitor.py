"""``oed monitor`` and ``oed fleet`` from the command line: results, states, and bad input."""

from __future__ import annotations

import json

import numpy as np
import pytest

from tests.estimation.monitoring.arm import Arm, write

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """A model, and logs of two days; from the second day on, joint 3 has 40 % more friction."""
    place = tmp_path_factory.mktemp("monitor")
    arm = Arm(place)
    arm.model.save(place / "model.json")

    def worn(t):
        return np.where(t[:, None] >= 80000.0, [1, 1, 1.4, 1, 1, 1], 1.0)

    for name, start in (("day1", 0.0), ("day2", 86400.0)):
        write(arm.log(start, 60.0, factor=worn), place / "logs" / f"{name}.csv")
    (place / "logs" / "day3.csv").write_text("nonsense")
    return place


def test_damage_is_red(run, place, tmp_path):
    """The page, monitor.json and trends.csv are written; a corrupt log of a folder costs a row."""
    words = ("monitor", "--model", place, "--log-dir", place / "logs", "--heat", "none", "--out", tmp_path / "out")
    done = run(*words, "--json")
    assert done.code == 0
    assert done.data["light"] == "red"
    (found,) = done.data["findings"]
    assert (found["kind"], found["joint"], found["log"]) == ("damage", 3, "day2")
    assert found["ci95"][0] <= 40.0 <= found["ci95"][1]
    assert [row["name"] for row in done.data["logs"] if not row["used"]] == ["day3"]
    assert json.loads((tmp_path / "out" / "monitor.json").read_text()) == done.data
    assert (tmp_path / "out" / "trends.csv").is_file()
    page = (tmp_path / "out" / "report.html").read_text()
    assert "Action needed" in page
    assert run(*words).code == 2


def test_a_state_continues(run, place, tmp_path):
    """Day 2 by a saved state gives the finding of both days in one run; other settings are refused."""
    state = tmp_path / "state"
    words = ("--model", place, "--heat", "none", "--state", state, "--out")
    assert run("monitor", "--log", place / "logs" / "day1.csv", *words, tmp_path / "one").code == 0
    done = run("monitor", "--log", place / "logs" / "day2.csv", *words, tmp_path / "two", "--json")
    assert [(f["kind"], f["joint"]) for f in done.data["findings"]] == [("damage", 3)]
    refused = run("monitor", "--log", place / "logs" / "day1.csv", *words, tmp_path / "three", "--window", "5")
    assert refused.code == 2
    assert "other settings" in refused.err


def test_bad_input(run, place, tmp_path):
    """Neither logs nor a model, a named log that is corrupt, and a heat that does not exist: exit code 2."""
    out = ("--out", tmp_path / "out")
    assert run("monitor", "--model", place, *out).code == 2
    assert run("monitor", "--model", tmp_path / "absent", "--log", place / "logs" / "day1.csv", *out).code == 2
    assert run("monitor", "--model", place, "--log", place / "logs" / "day3.csv", *out).code == 2
    assert run("monitor", "--model", place, "--log-dir", place / "logs", "--heat", "warm", *out).code == 2
    assert not (tmp_path / "out").exists()


def test_fleet_has_a_page(run, place, tmp_path):
    """A folder of logs is a robot per log, a corrupt one first; a second run is refused, or resumed."""
    words = ("fleet", place / "logs", "--model", place, "--heat", "none", "--workers", "1", "--out", tmp_path / "out")
    done = run(*words, "--json")
    assert done.code == 0
    assert [row["light"] for row in done.data["robots"]] == ["grey", "green", "green"]
    assert "Robots, worst first" in (tmp_path / "out" / "report.html").read_text()
    assert run(*words).code == 2
    assert run(*words, "--force", "--json").data["resumed"] == 3


def test_an_interrupted_fleet_says_what_is_kept(run, place, tmp_path, monkeypatch):
    """Ctrl-C ends a fleet with one line that says where the finished robots are."""

    def stop(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr("estimation.monitoring.fleets.monitor_fleet", stop)
    done = run("fleet", place / "logs", "--model", place, "--out", tmp_path / "out")
    assert done.code == 130
    assert f"finished robots are kept in {tmp_path / 'out' / 'robots'}" in done.err
    assert "nothing was written" not in done.err

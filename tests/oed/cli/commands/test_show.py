"""``oed show`` from the command line: trajectories, logs, diagnoses, and bad input."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from oed.exports import write_trajectory
from robots.signals import Motion

pytestmark = pytest.mark.slow


@pytest.fixture
def log(tmp_path: Path) -> Path:
    """Four seconds of two joints, with torque."""
    t = 0.01 * np.arange(400)
    q = np.sin(2 * t)[:, None] * [0.5, 0.9]
    path = tmp_path / "log.csv"
    table = np.column_stack([t, q, 5 + 0 * q])
    np.savetxt(path, table, delimiter=",", header="t,q1,q2,tau1,tau2", comments="", fmt="%.9g")
    return path


def test_log(run, robot, log, tmp_path: Path) -> None:
    """A log becomes one page; the JSON names the closest approaches; nothing is overwritten unasked."""
    out = tmp_path / "robot.html"
    done = run("show", log, "--robot", robot, "--out", out, "--json")
    assert done.code == 0
    assert done.data["duration"] == pytest.approx(3.99)
    # Joint 2 reaches 1.8 of 2 rad/s.
    fastest = next(m for m in done.data["closest_approaches"] if m["quantity"] == "velocity" and m["joint"] == 2)
    assert fastest["slack_fraction"] == pytest.approx(0.1, abs=0.01)
    assert "<canvas" in out.read_text()
    again = run("show", log, "--robot", robot, "--out", out)
    assert (again.code, "the file exists" in again.err) == (2, True)
    assert run("show", log, "--robot", robot, "--out", out, "--force", "--quiet").out == ""


def test_trajectory(run, tmp_path: Path, robot) -> None:
    """A trajectory names its robot; limits that it exceeds are in the verdict."""
    t = 0.01 * np.arange(201)
    # A quarter turn in 0.5 s is faster than 2 rad/s.
    s, w = 0.25 * np.pi, np.pi
    q, dq, ddq = s * (1 - np.cos(w * t)), s * w * np.sin(w * t), s * w**2 * np.cos(w * t)
    path, out = tmp_path / "trajectory.csv", tmp_path / "robot.html"
    write_trajectory(path, Motion(t, *(np.column_stack([v, v]) for v in (q, dq, ddq))), {"robot": str(robot)})
    done = run("show", path, "--out", out)
    assert done.code == 0, done.err
    assert "Action needed" in out.read_text()
    assert "exceeds" in out.read_text()
    # An edited copy of the robot may be shown; a note says that the file names another.
    copy = tmp_path / "copy.yaml"
    copy.write_text(robot.read_text().replace("name: ", "name: copy_of_"))
    noted = run("show", path, "--robot", copy, "--out", tmp_path / "copy.html")
    assert (noted.code, "trajectory.csv was made for" in noted.err) == (0, True)
    assert "was made for" not in run("show", path, "--robot", robot, "--out", tmp_path / "own.html").err


def test_bad_input(run, robot, log, tmp_path: Path) -> None:
    """One message each, code 2, and no page."""
    out = tmp_path / "robot.html"
    diagnosis = tmp_path / "diagnosis.json"
    diagnosis.write_text(json.dumps({"verdict": "named"}))
    for words, text in (
        ([tmp_path / "none.csv", "--robot", robot], "no such file"),
        ([log], "give --robot"),
        ([log, "--robot", "er3a"], "q3"),
        ([log, "--robot", robot, "--diagnosis", tmp_path / "nowhere"], "no such file"),
        ([log, "--robot", robot, "--diagnosis", diagnosis], "model.json"),
        ([tmp_path, "--robot", robot], "folder"),
    ):
        done = run("show", *words, "--out", out)
        assert done.code == 2, words
        assert text in done.err
        assert "Traceback" not in done.err
        assert not out.exists()

"""The commands that read logs: what they write, and how they refuse."""

import json
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from estimation import load_model, write_log
from oed.cli import main
from robots.loading import load_robot
from robots.plants import nominal_plant, simulate


@dataclass
class Ended:
    """How a command ended."""

    code: int
    out: str
    err: str


@pytest.fixture
def run(monkeypatch, capsys):
    """Runs a command in this process."""

    def run(*arguments):
        monkeypatch.setattr(sys, "argv", ["oed", *map(str, arguments)])
        with pytest.raises(SystemExit) as ended:
            main()
        said = capsys.readouterr()
        return Ended(int(ended.value.code or 0), said.out, said.err)

    return run


@pytest.fixture(scope="module")
def log_file(tmp_path_factory, fourier_motion):
    robot = load_robot("er3a")
    path = tmp_path_factory.mktemp("logs") / "log.csv"
    write_log(path, simulate(nominal_plant(robot), fourier_motion(robot, duration=10.0, period=0.01)))
    return path


@pytest.fixture
def edited(log_file, tmp_path):
    """Writes the log with its header and rows changed."""

    def edit(change):
        lines = [line for line in log_file.read_text().splitlines() if not line.startswith("#")]
        table = [line.split(",") for line in lines]
        change(table)
        path = tmp_path / "log.csv"
        path.write_text("\n".join(",".join(row) for row in table) + "\n")
        return path

    return edit


def refused(ended, code, *fragments):
    """One message on standard error, no traceback, nothing on standard output."""
    assert ended.code == code, ended.err
    assert ended.out == ""
    messages = [line for line in ended.err.splitlines() if not line.startswith("note: ")]
    assert len(messages) == 1, ended.err
    assert messages[0].startswith("oed: ")
    for fragment in fragments:
        assert fragment in messages[0]


@pytest.mark.slow
def test_identify_then_predict(run, log_file, tmp_path):
    """Identify writes model.json and report.html, predict a table; both print JSON on request."""
    out = tmp_path / "out"
    ended = run("identify", "--robot", "er3a", "--log", log_file, "--out", out, "--json")
    assert ended.code == 0, ended.err
    assert json.loads(ended.out)["success"] in (True, False)
    assert {path.name for path in out.iterdir()} == {"model.json", "report.html"}
    assert len(load_model(out).names) == 70
    ended = run("predict", "--model", out, "--log", log_file, "--out", tmp_path / "p.csv", "--json")
    assert ended.code == 0, ended.err
    assert max(json.loads(ended.out)["nrmse"]) < 0.1
    header = next(line for line in (tmp_path / "p.csv").read_text().splitlines() if not line.startswith("#"))
    assert header.startswith("t,tau1,tau2,tau3,tau4,tau5,tau6,tau1_lower,tau1_upper,tau1_extrapolates,")


def _delete(column):
    def change(table):
        index = table[0].index(column)
        for row in table:
            del row[index]

    return change


def _write(row, column, value):
    def change(table):
        table[row][table[0].index(column)] = value

    return change


def _swap(first, second):
    def change(table):
        table[first], table[second] = table[second], table[first]

    return change


def _last_joint(table):
    for name in ("q6", "tau6"):
        _delete(name)(table)


FAULTS = {
    "a missing position": (_delete("q3"), ("column q3", "missing")),
    "a missing torque": (_delete("tau2"), ("column tau2", "missing")),
    "no time": (_delete("t"), ("column t", "missing")),
    "infinity": (_write(7, "tau4", "inf"), ("column tau4", "row 8", "inf")),
    "text": (_write(9, "q1", "high"), ("column q1", "row 10", "high")),
    "backward time": (_swap(20, 21), ("column t", "row 22", "backward")),
    "five joints": (_last_joint, ("5 joints", "robot has 6")),
}


@pytest.mark.parametrize(("change", "fragments"), FAULTS.values(), ids=FAULTS.keys())
def test_faulty_logs_are_refused(run, edited, tmp_path, change, fragments):
    """A faulty log is refused with exit code 2, naming file, column and row, and nothing is left behind."""
    path = edited(change)
    before = set(tmp_path.rglob("*"))
    refused(run("identify", "--robot", "er3a", "--log", path, "--out", tmp_path / "out"), 2, str(path), *fragments)
    assert set(tmp_path.rglob("*")) == before


@pytest.mark.slow
def test_unknown_names_are_refused(run, log_file, tmp_path):
    """Unknown methods, friction models, robots and files are refused with what there is."""
    out = tmp_path / "out"
    for option, value, fragment in (
        ("--method", "kalman", "allowed: wls, ols"),
        ("--friction", "oil", "allowed: auto, polynomial, coulomb-viscous"),
    ):
        ended = run("identify", "--robot", "er3a", "--log", log_file, "--out", out, option, value)
        refused(ended, 2, repr(value), fragment)
    refused(run("identify", "--robot", "er3b", "--log", log_file, "--out", out), 2, "did you mean 'er3a'?")
    refused(run("identify", "--robot", "er3a", "--log", tmp_path / "no.csv", "--out", out), 2, "no.csv")
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_results_are_not_overwritten(run, log_file, tmp_path):
    """Existing results are kept, byte for byte, and the message names the file and --force."""
    (tmp_path / "model.json").write_text("mine")
    ended = run("identify", "--robot", "er3a", "--log", log_file, "--out", tmp_path)
    refused(ended, 2, str(tmp_path / "model.json"), "force")
    assert [path.name for path in tmp_path.iterdir()] == ["model.json"]
    assert (tmp_path / "model.json").read_text() == "mine"
    ended = run("identify", "--robot", "er3a", "--log", log_file, "--out", tmp_path, "--force", "--quiet")
    assert (ended.code, ended.out) == (0, "")
    assert load_model(tmp_path).robot.name == "er3a"


def test_a_log_in_which_nothing_moves(run, edited, tmp_path):
    """A standing arm is not bad input: exit code 1, with the reason, and nothing written."""

    def stand(table):
        columns = [table[0].index(f"q{joint}") for joint in range(1, 7)]
        for row in table[1:]:
            for column in columns:
                row[column] = "0.25"

    path = edited(stand)
    refused(run("identify", "--robot", "er3a", "--log", path, "--out", tmp_path / "out"), 1, "no joint moves")
    assert [item.name for item in tmp_path.iterdir()] == ["log.csv"]


def test_predict_refuses_what_is_no_model(run, log_file, tmp_path):
    """A damaged model is refused by its name, and no table is written."""
    model = tmp_path / "model.json"
    model.write_text('{"format": "robot-oed model", "format_version": 1}')
    refused(
        run("predict", "--model", model, "--log", log_file, "--out", tmp_path / "p.csv"),
        2,
        str(model),
        "column robot: is missing",
    )
    assert [path.name for path in tmp_path.iterdir()] == ["model.json"]


@pytest.mark.slow
def test_the_installed_command_says_the_same(edited, tmp_path):
    """The console script itself ends with code 2 and one line, without a traceback."""
    script = shutil.which("oed", path=str(Path(sys.executable).parent)) or shutil.which("oed")
    if script is None:
        pytest.skip("the command is not installed")
    path = edited(_write(7, "tau4", "inf"))
    arguments = [script, "identify", "--robot", "er3a", "--log", str(path), "--out", str(tmp_path / "out")]
    ended = subprocess.run(arguments, capture_output=True, text=True, timeout=60, check=False)
    refused(Ended(ended.returncode, ended.stdout, ended.stderr), 2, str(path), "column tau4", "row 8")
    assert not (tmp_path / "out").exists()
    assert np.count_nonzero(["Traceback" in ended.stderr]) == 0

"""Each command's own work, and what all commands have in common."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from estimation import read_log
from oed.exports import read_trajectory
from robots.loading import load_robot
from robots.version import VERSION
from tests.oed import flat
from tests.oed.cli.conftest import TINY

RESULTS = {
    "design": ("trajectory.csv", "design.json", "report.html"),
    "retime": ("trajectory.csv", "design.json", "report.html"),
    "export": ("out.csv",),
    "simulate": ("out.csv",),
    "identify": ("model.json", "report.html"),
    "predict": ("out.csv",),
}
EACH = pytest.mark.parametrize("command", list(RESULTS))


@pytest.fixture(scope="session")
def short(robot: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A trajectory of 5 s without strokes, which is soon retimed."""
    folder = tmp_path_factory.mktemp("short")
    options = {"effort": TINY, "workers": 1, "periods": 1, "base_frequency": 0.25, "strokes": False}
    flat.design(load_robot(robot), **options).save(folder)
    return folder / "trajectory.csv"


@pytest.fixture
def arguments(robot: Path, experiment: Path, short: Path, tmp_path: Path):
    """Give a command's arguments, its results going to this test's own folder."""
    lines = {
        "design": ["--robot", robot, "--effort", "quick", "--workers", 1, "--periods", 1, "--out", tmp_path],
        "retime": [short, "--robot", robot, "--out", tmp_path],
        "export": [experiment / "trajectory.csv", "--out", tmp_path / "out.csv"],
        "simulate": ["--robot", robot, "--trajectory", experiment / "trajectory.csv", "--out", tmp_path / "out.csv"],
        "identify": ["--robot", robot, "--log", experiment / "log.csv", "--out", tmp_path],
        "predict": [
            "--model",
            experiment / "model.json",
            "--log",
            experiment / "log.csv",
            "--out",
            tmp_path / "out.csv",
        ],
    }
    return lambda command: [command, *lines[command]]


@pytest.mark.slow
@EACH
def test_writes_its_results(command: str, run, arguments, tmp_path: Path) -> None:
    """A command writes its files, all of them and no other, and a summary that says where."""
    done = run(*arguments(command))
    assert (done.code, done.err.count("Traceback")) == (0, 0), done.err
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(RESULTS[command])
    assert str(tmp_path) in done.out


@pytest.mark.slow
@EACH
def test_never_overwrites(command: str, run, arguments, tmp_path: Path) -> None:
    """Results that are there stay as they are, with code 2 and the way out; with --force they are replaced."""
    for name in RESULTS[command]:
        (tmp_path / name).write_text("precious")
    done = run(*arguments(command))
    assert done.code == 2
    assert "--force" in done.err
    assert done.err.count("\n") == done.err.count("note:") + 1
    assert done.out == ""
    for name in RESULTS[command]:
        assert (tmp_path / name).read_text() == "precious"
    assert run(*arguments(command), "--force").code == 0
    for name in RESULTS[command]:
        assert (tmp_path / name).read_text() != "precious"


@pytest.mark.slow
@EACH
def test_json(command: str, run, arguments) -> None:
    """With --json, standard output is one JSON object and nothing else."""
    done = run(*arguments(command), "--json")
    assert done.code == 0
    assert isinstance(done.data, dict)


@pytest.mark.slow
@EACH
def test_quiet(command: str, run, arguments) -> None:
    """With --quiet, nothing is printed at all."""
    done = run(*arguments(command), "--quiet")
    assert (done.code, done.out, done.err) == (0, "", "")


@pytest.mark.slow
@EACH
def test_interrupted(command: str, run, arguments, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Ctrl-C ends a command with code 130, one line, and no file or folder left."""

    def interrupt(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    # The last step of each command: everything before has been done.
    places = {
        "design": "oed.reports.save_report",
        "retime": "oed.reports.save_report",
        "export": "oed.exports.writing.write_trajectory",
        "simulate": "estimation.logs.write_log",
        "identify": "oed.reports.save_report",
        "predict": "estimation.predictions.prediction.Prediction.save",
    }
    monkeypatch.setattr(places[command], interrupt)
    done = run(*arguments(command))
    assert done.code == 130
    assert done.err.splitlines()[-1] == "oed: interrupted; nothing was written"
    assert "Traceback" not in done.err
    assert list(tmp_path.iterdir()) == []


@EACH
def test_help(command: str, run) -> None:
    """Each command explains itself and its options."""
    done = run(command, "--help")
    assert done.code == 0
    assert f"oed {command}" in done.out
    assert "--json" in done.out


def test_notes_go_to_standard_error(run, arguments) -> None:
    """Assumed values are noted once, on standard error, in short: the note says where they are listed."""
    done = run(*arguments("simulate"))
    assert done.err.count("note: two: ") == 1
    assert "note: two: its description has assumed values or other notes; oed robot show " in done.err
    assert "note:" not in done.out


@pytest.mark.slow
@pytest.mark.parametrize("command", ["design", "identify"])
def test_work_on_a_robot_begins_with_all_notes(command: str, run, arguments) -> None:
    """A design and an identification list the assumed values in full."""
    done = run(*arguments(command))
    assert done.err.count("note: two: these values are assumptions without a source: ") == 1


def test_version(run) -> None:
    """The version is reported."""
    done = run("--version")
    assert (done.code, done.out.strip()) == (0, f"robot-oed {VERSION}")


@pytest.mark.slow
def test_whole_loop(run, robot: Path, experiment: Path, tmp_path: Path) -> None:
    """Simulated, identified and predicted, the robot's torque comes back to within its noise."""
    log, model, out = tmp_path / "log.parquet", tmp_path / "model", tmp_path / "p.csv"
    assert run("simulate", "--robot", robot, "--trajectory", experiment / "trajectory.csv", "--out", log).code == 0
    assert run("identify", "--robot", robot, "--log", log, "--out", model, "--png").code == 0
    assert list(model.glob("*.png"))
    done = run("predict", "--model", model, "--log", log, "--out", out, "--json")
    table, recorded = pd.read_csv(out, comment="#"), read_log(log)
    assert list(table.columns)[:3] == ["t", "tau1", "tau2"]
    for joint in (0, 1):
        measured = np.interp(table["t"], recorded.t, recorded.tau[:, joint])
        error = np.std(table[f"tau{joint + 1}"] - measured) / np.sqrt(np.mean(measured**2))
        # The virtual sensors add 2 % of the torque RMS; where a joint turns, smoothing blunts the step of friction.
        assert error < 0.06
    assert done.data["file"] == str(out)


@pytest.mark.slow
def test_export_forms(run, experiment: Path, tmp_path: Path) -> None:
    """An export has the columns and the unit that are asked for; the full one in degrees reads back."""
    source = experiment / "trajectory.csv"
    bare, degrees = tmp_path / "bare.csv", tmp_path / "degrees.csv"
    assert run("export", source, "--positions-only", "--bare", "--degrees", "--out", bare).code == 0
    assert run("export", source, "--degrees", "--out", degrees).code == 0
    motion = read_trajectory(source)[0]
    table = pd.read_csv(bare)
    assert list(table.columns) == ["t", "q1", "q2"]
    np.testing.assert_allclose(np.deg2rad(table["q1"]), motion.q[:, 0], atol=1e-12)
    np.testing.assert_allclose(read_trajectory(degrees)[0].dq, motion.dq, atol=1e-12)


@pytest.mark.slow
def test_design_options_reach_the_design(run, robot: Path, tmp_path: Path) -> None:
    """Options of the command line are those of the design."""
    done = run(
        *("design", "--robot", robot, "--effort", "quick", "--workers", 1, "--out", tmp_path, "--json"),
        *("--criterion", "d", "--friction", "coulomb-viscous", "--offset", "--harmonics", 4, "--base-frequency", 0.2),
        *("--periods", 2, "--no-strokes", "--velocity-fraction", 0.8, "--seed", 3, "--time-limit", 60),
    )
    settings = done.data["settings"]
    expected = {
        "friction": "coulomb-viscous",
        "offset": True,
        "harmonics": 4,
        "base_frequency": 0.2,
        "periods": 2,
        "strokes": False,
        "velocity_fraction": 0.8,
        "seed": 3,
        "time_limit": 60.0,
    }
    assert {key: settings[key] for key in expected} == expected
    assert done.data["criterion"] == "d"


@pytest.mark.slow
def test_an_export_of_limits_holds_no_samples(run, experiment: Path, tmp_path: Path) -> None:
    """MoveIt's limits are limits: neither the line nor the JSON counts samples."""
    words = ("export", experiment / "trajectory.csv", "--to", "moveit-limits", "--out", tmp_path / "limits.yaml")
    assert "limits of velocity, acceleration and jerk of 2 joints written to" in run(*words).out
    assert run(*words, "--force", "--json").data["samples"] is None

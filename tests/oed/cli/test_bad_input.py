"""Bad input ends with one message that names it, the right code, no traceback, and nothing half-written."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from robots.common.errors import InputError


def refused(done, out: Path, *words: str, code: int = 2) -> None:
    """Check that a command said no, once, in the right words, and left nothing."""
    lines = [line for line in done.err.splitlines() if not line.startswith("note:")]
    assert done.code == code, done.err
    assert done.out == ""
    assert len(lines) == 1, done.err
    assert lines[0].startswith("oed: ")
    for word in words:
        assert word in lines[0], lines[0]
    assert not out.exists() or list(out.iterdir()) == []


@pytest.fixture
def out(tmp_path: Path) -> Path:
    return tmp_path / "out"


@pytest.fixture
def trajectory(experiment: Path) -> pd.DataFrame:
    return pd.read_csv(experiment / "trajectory.csv", comment="#")


DESIGN = ("design", "--effort", "quick", "--workers", 1, "--out")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--robot", "er3b"), ("er3b", "did you mean 'er3a'")),
        (("--robot", "missing.yaml"), ("missing.yaml",)),
        (("--robot", "missing.urdf"), ("missing.urdf",)),
        (("--robot", "er3a", "--criterion", "best"), ("best", "a, cond, cond-d, d, e")),
        (("--robot", "er3a", "--friction", "magic"), ("magic", "polynomial")),
        (("--robot", "er3a", "--effort", "huge"), ("huge", "quick, standard, thorough")),
        (("--robot", "er3a", "--harmonics", 1), ("harmonics",)),
        (("--robot", "er3a", "--periods", 0), ("periods",)),
        (("--robot", "er3a", "--base-frequency", "-1"), ("base frequency",)),
        (("--robot", "er3a", "--velocity-fraction", 2), ("velocity fraction",)),
        (("--robot", "er3a", "--time-limit", "-1"), ("time limit",)),
        (("--robot", "er3a", "--after", "missing"), ("missing", "model.json")),
        (("--robot", "er3a", "--task", "missing.csv"), ("missing.csv",)),
        (("--robot", "er3a", "--criterion", "i"), ("criterion i", "task")),
        (("--robot", "er3a", "--scaling", "odd"), ("odd", "none, nominal, unit")),
        (("--robot", "er3a", "--noise", "1,2,x"), ("--noise 1,2,x", "commas")),
        (("--robot", "er3a", "--home", "0,0"), ("home pose",)),
        (("--robot", "er3a", "--home", "9,0,0,0,0,0"), ("joint 1", "home pose")),
        (("--robot", "ur10", "--lock", "elbow_joint"), ("--lock elbow_joint", "name=value")),
        (("--robot", "ur10", "--lock", "elbow_joint=far"), ("--lock elbow_joint=far", "name=value")),
        (("--robot", "ur10", "--lock", "elbow_joint=nan"), ("elbow_joint",)),
        (("--robot", "ur10", "--lock", "knee=1"), ("knee",)),
    ],
)
def test_design_options(options: tuple, words: tuple, run, out: Path) -> None:
    """An option that means nothing is named with what is allowed."""
    refused(run(*DESIGN, out, *options), out, *words)


def test_infeasible(run, stuck: Path, out: Path) -> None:
    """A joint that cannot move makes the design infeasible: code 1, with the joint."""
    refused(run(*DESIGN, out, "--robot", stuck), out, "joint 2", "velocity limit", code=1)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda text: text.replace("lower: [-2, -2]", "lower: [-2, 3]"), ("joint 2",)),
        (lambda text: text.replace("velocity:", "velocty:"), ("velocty",)),
        (lambda text: text.replace("[10, 10]", "[10]"), ("limits.acceleration", "2")),
        (lambda text: text[:200] + "{", ()),
    ],
)
def test_robot_files(change, words: tuple, run, robot: Path, out: Path, tmp_path: Path) -> None:
    """A robot file is refused by its name and key or joint."""
    path = tmp_path / "wrong.yaml"
    path.write_text(change(robot.read_text()))
    refused(run(*DESIGN, out, "--robot", path), out, "wrong.yaml", *words)


@pytest.mark.parametrize(
    "arguments",
    [
        ("design", "--robot", "er3a", "--colour", "red"),
        ("design",),
        ("design", "--robot", "er3a", "--seed", "-1"),
        ("design", "--robot", "er3a", "--seed", "x"),
        ("design", "--robot", "er3a", "--workers", "0"),
        ("identify", "--robot", "er3a"),
        ("dance",),
        ("--colour",),
        (),
    ],
)
def test_usage(arguments: tuple, run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """An unknown command or option, or a missing one, is a usage error: code 2, nothing written, no traceback."""
    monkeypatch.chdir(tmp_path)
    done = run(*arguments)
    if arguments:
        refused(done, tmp_path, "--help`")
    else:
        assert done.code == 2
        assert "Usage: oed" in done.err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("arguments", "answer"),
    [
        (("identfy", "--robot", "er3a"), "no command identfy; did you mean identify?; see `oed --help`"),
        (("dance",), "no command dance; allowed: example, robots, "),
        (("identify", "--robbot", "er3a"), "no option --robbot; did you mean --robot?; see `oed identify --help`"),
        (("identify", "--lgo", "x"), "no option --lgo; did you mean --log?"),
        (("predict", "--model", "x", "--xyz"), "no option --xyz; see `oed predict --help`"),
        (("diagnose", "--robot", "er3a", "a.csv"), "unexpected a.csv; logs are given by --log; see"),
        (("design",), "missing option --robot; see `oed design --help`"),
        (("design", "--seed", "x", "--robot", "er3a"), "invalid value for --seed: "),
        (("simulate",), "give either --trajectory or --campaign; see `oed simulate --help`"),
    ],
)
def test_usage_errors_are_answered_in_one_style(arguments: tuple, answer: str, run, tmp_path: Path) -> None:
    """A wrong name is answered with the nearest right one, and every usage error with where to read on."""
    refused(run(*arguments), tmp_path, answer)


def spoilt(table: pd.DataFrame, fault: str) -> tuple[pd.DataFrame, tuple[str, ...]]:
    """Spoil a trajectory, and say what the message must name."""
    table = table.copy()
    if fault == "nan":
        table.loc[5, "q2"] = float("nan")
        return table, ("column q2", "row 7")
    if fault == "backward":
        table.loc[6, "t"] = table.loc[4, "t"]
        return table, ("column t", "row 8")
    if fault == "column":
        return table.drop(columns="dq1"), ("column dq1", "missing")
    if fault == "joints":
        return table.assign(q3=0.0, dq3=0.0, ddq3=0.0), ("3 joints", "2")
    return table.iloc[:0], ()


@pytest.mark.slow
@pytest.mark.parametrize("fault", ["nan", "backward", "column", "joints", "empty"])
@pytest.mark.parametrize("command", ["simulate", "retime", "export"])
def test_trajectories(
    command: str, fault: str, run, robot: Path, trajectory: pd.DataFrame, out: Path, tmp_path: Path
) -> None:
    """A spoilt trajectory is refused by file, column and row."""
    path = tmp_path / "spoilt.csv"
    table, words = spoilt(trajectory, fault)
    table.to_csv(path, index=False)
    target = out / "log.csv"
    lines = {
        "simulate": ("simulate", "--robot", robot, "--trajectory", path, "--out", target),
        "retime": ("retime", path, "--robot", robot, "--out", out),
        "export": ("export", path, "--robot", robot, "--out", target),
    }
    refused(run(*lines[command]), out, *words, *(() if fault == "joints" else ("spoilt.csv",)))


@pytest.mark.parametrize("command", ["simulate", "retime", "export"])
def test_missing_trajectory(command: str, run, robot: Path, out: Path) -> None:
    """A file that is not there is named."""
    lines = {
        "simulate": ("simulate", "--robot", robot, "--trajectory", "nowhere.csv", "--out", out / "log.csv"),
        "retime": ("retime", "nowhere.csv", "--robot", robot, "--out", out),
        "export": ("export", "nowhere.csv", "--out", out / "log.csv"),
    }
    refused(run(*lines[command]), out, "nowhere.csv")


def test_simulate_needs_a_motion(run, robot: Path, out: Path) -> None:
    """A simulation without a motion asks for one."""
    done = run("simulate", "--robot", robot, "--out", out / "log.csv")
    assert done.code == 2
    assert "--trajectory" in done.err
    assert not out.exists()


@pytest.mark.slow
def test_retime_without_a_robot(run, trajectory: pd.DataFrame, out: Path, tmp_path: Path) -> None:
    """A file that names no robot asks for one."""
    path = tmp_path / "bare.csv"
    trajectory.to_csv(path, index=False)
    refused(run("retime", path, "--out", out), out, "bare.csv", "--robot")


def test_export_form(run, experiment: Path, out: Path) -> None:
    """An unknown form is answered with the known ones."""
    refused(run("export", experiment / "trajectory.csv", "--to", "fax", "--out", out / "x"), out, "fax", "csv")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("frction: polynomial\n", ("frction",)),
        ("spread: -1\n", ("spread",)),
        ("parameters: {f9_1: 3}\n", ("f9_1",)),
        ("sensors: {torque_noise: -1}\n", ("torque_noise",)),
        ("sensors: {noise: 1}\n", ("noise",)),
        ("[", ()),
    ],
)
def test_plants(text: str, words: tuple, run, robot: Path, experiment: Path, out: Path, tmp_path: Path) -> None:
    """A plant file is refused by its name and key."""
    path = tmp_path / "plant.yaml"
    path.write_text(text)
    line = ("simulate", "--robot", robot, "--trajectory", experiment / "trajectory.csv", "--plant", path)
    refused(run(*line, "--out", out / "log.csv"), out, "plant.yaml", *words)


def test_simulating_the_unknown(run, experiment: Path, robot: Path, out: Path, tmp_path: Path) -> None:
    """A robot without nominal dynamics cannot be simulated, and the message says what lacks."""
    path = tmp_path / "bare.yaml"
    path.write_text(robot.read_text().split("dynamics:")[0])
    line = ("simulate", "--robot", path, "--trajectory", experiment / "trajectory.csv", "--out", out / "log.csv")
    refused(run(*line), out, "joint 1", "a virtual robot needs masses", "--assume-masses KG")


@pytest.mark.slow
@pytest.mark.parametrize("command", ["identify", "predict"])
@pytest.mark.parametrize("fault", ["missing", "no torque", "joints", "infinite", "backward"])
def test_logs(command: str, fault: str, run, robot: Path, experiment: Path, out: Path, tmp_path: Path) -> None:
    """A log that cannot serve is refused by file and column."""
    path = tmp_path / "spoilt.csv"
    log = pd.read_csv(experiment / "log.csv", comment="#")
    words: tuple[str, ...] = ("spoilt.csv",)
    if fault == "no torque":
        log = log[["t", "q1", "q2"]]
        words += ("tau",)
    elif fault == "joints":
        log = log.drop(columns=["q2", "tau2"])
        words += ("q2",)
    elif fault == "infinite":
        log.loc[5, "q1"] = float("inf")
        words += ("q1",)
    elif fault == "backward":
        log.loc[6, "t"] = log.loc[4, "t"] - 0.1
        words += ("column t",)
    if fault != "missing":
        log.to_csv(path, index=False)
    lines = {
        "identify": ("identify", "--robot", robot, "--log", path, "--out", out),
        "predict": ("predict", "--model", experiment / "model.json", "--log", path, "--out", out / "p.csv"),
    }
    if command == "predict" and fault == "no torque":  # that is all a prediction needs
        out.mkdir()
        assert run(*lines[command]).code == 0
        return
    refused(run(*lines[command]), out, *words)


def test_models(run, experiment: Path, out: Path, tmp_path: Path) -> None:
    """A missing or damaged model is named."""
    log = experiment / "log.csv"
    refused(run("predict", "--model", tmp_path / "no.json", "--log", log, "--out", out / "p.csv"), out, "no.json")
    path = tmp_path / "model.json"
    path.write_text("{}")
    refused(run("predict", "--model", path, "--log", log, "--out", out / "p.csv"), out, "model.json")


def test_a_file_where_the_folder_should_be(run, robot: Path, tmp_path: Path) -> None:
    """Results that have no place are refused before the work, and the file in their way stays."""
    place = tmp_path / "taken"
    place.write_text("mine")
    done = run(*DESIGN, place, "--robot", robot)
    assert done.code == 2
    assert "taken" in done.err
    assert "Traceback" not in done.err
    assert place.read_text() == "mine"


@pytest.mark.slow
def test_a_full_disk_leaves_nothing(run, robot: Path, out: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """When the last file cannot be written, none is."""

    def full(path: Path, *_: object) -> None:
        raise InputError("cannot be written (no space left on device)", file=path)

    monkeypatch.setattr("oed.reports.rendering.saving.write_atomic", full)
    refused(run(*DESIGN, out, "--robot", robot), out, "report.html", "no space left")

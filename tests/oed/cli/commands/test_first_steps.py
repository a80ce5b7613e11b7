"""The commands of the first minutes: example files, the list of effects, the state of the installation."""

from __future__ import annotations

import shlex
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import pytest

from oed import installation
from oed.examples.files import FILES, next_commands, write_example
from robots.common.errors import InputError
from robots.terms.effects import EFFECTS, EXPERIMENTS


def test_example_files_are_small_and_complete(run, tmp_path: Path) -> None:
    """All files are there, below a megabyte, and a second call overwrites nothing without --force."""
    done = run("example", "--out", tmp_path / "a")
    assert done.code == 0
    assert sorted(path.name for path in (tmp_path / "a").iterdir()) == sorted(FILES)
    assert sum(path.stat().st_size for path in (tmp_path / "a").iterdir()) < 1e6
    (tmp_path / "a" / "log.csv").write_text("mine")
    done = run("example", "--out", tmp_path / "a")
    assert (done.code, done.out) == (2, "")
    assert "--force" in done.err
    assert (tmp_path / "a" / "log.csv").read_text() == "mine"
    assert run("example", "--out", tmp_path / "a", "--force", "--quiet").out == ""
    assert (tmp_path / "a" / "log.csv").read_text() != "mine"


def test_example_files_are_what_they_are_called(tmp_path: Path) -> None:
    """The robot, the plants and the logs are read, and the logs are of different motions."""
    from estimation import read_log
    from robots.loading import load_robot
    from robots.plants import load_plant

    write_example(tmp_path)
    robot = load_robot(tmp_path / "robot.yaml")
    logs = [read_log(tmp_path / name, robot.n) for name in ("log.csv", "held_out.csv")]
    assert all(30 < log.duration < 90 for log in logs)
    assert abs(logs[0].q[1000] - logs[1].q[1000]).max() > 0.1
    for name in ("plant.yaml", "worn.yaml"):
        load_plant(tmp_path / name, robot)


def test_next_commands_parse(run, tmp_path: Path) -> None:
    """The three commands name commands and options that exist, and the files that were written."""
    done = run("example", "--out", tmp_path / "a", "--json")
    commands = done.data["commands"]
    assert commands == list(next_commands(tmp_path / "a"))
    for command in commands:
        words = shlex.split(command)
        assert words[0] == "oed"
        assert run(*words[1:2], "--help").code == 0
        for option in (word for word in words if word.startswith("--")):
            assert option in run(words[1], "--help").out
    assert {Path(word).name for word in shlex.split(commands[1])} >= {"robot.yaml", "log.csv", "held_out.csv"}


@pytest.mark.slow
@pytest.mark.longer
def test_next_commands_find_the_hidden_effect(run, tmp_path: Path) -> None:
    """Followed to the letter, the advice ends with the spring on joint 2, and its interval holds the true stiffness."""
    for command in run("example", "--out", tmp_path / "a", "--json").data["commands"]:
        done = run(*shlex.split(command)[1:], "--json")
        assert done.code == 0, done.err
        if " diagnose " in command:
            (finding,) = done.data["findings"]
            assert (finding["effect"], finding["joint"]) == ("spring", 2)


def test_a_folder_that_cannot_be_made_is_refused(tmp_path: Path) -> None:
    """A file in the way of the folder is named."""
    (tmp_path / "taken").write_text("mine")
    with pytest.raises(InputError, match="taken"):
        write_example(tmp_path / "taken")


def test_effects_are_all_listed(run) -> None:
    """The table has every effect of the catalogue, and each kind of experiment that it names."""
    text = run("effects").out
    rows = run("effects", "--json").data["effects"]
    assert [row["name"] for row in rows] == list(EFFECTS)
    for row in rows:
        assert row["name"] in text
        assert row["acts_on"] in ("joint", "robot")
        assert set(row["rivals"]) <= set(EFFECTS)
        for experiment in row["experiments"]:
            assert experiment["what"] == EXPERIMENTS[experiment["name"]]
            assert experiment["what"] in text
    assert run("effects", "--quiet").out == ""


def test_doctor_states_versions_and_extras(run) -> None:
    """Versions are those of the installed packages; extras say what they bring."""
    done = run("doctor", "--json")
    assert done.code == 0
    libraries = {entry["name"]: entry for entry in done.data["libraries"]}
    assert libraries["numpy"]["version"] == version("numpy")
    assert {"casadi", "scipy", "typer"} <= set(libraries)
    assert {"mat", "ros"} <= {extra["name"] for extra in done.data["extras"]}
    assert "test" not in {extra["name"] for extra in done.data["extras"]}
    assert "C compiler" in run("doctor").out


@pytest.mark.parametrize(
    ("needed", "status", "code"), [(">=1.0", "ok", 0), (">=99.1,<100", "too old", 1), (None, "missing", 1)]
)
def test_doctor_finds_what_is_wrong(run, monkeypatch: pytest.MonkeyPatch, needed, status: str, code: int) -> None:
    """A library that is missing or too old is named, with exit code 1 and what is needed."""
    name = "numpy" if needed else "no-such-library"
    monkeypatch.setattr(installation, "requires_of", lambda: [(name, needed or "", None), ("absent-too", "", "ros")])
    done = run("doctor", "--json")
    assert done.code == code
    assert done.data["libraries"][0]["status"] == status
    assert bool(done.data["problems"]) == bool(code)
    (extra,) = done.data["extras"]
    assert (extra["installed"], extra["install"]) == (False, "pip install 'robot-oed[ros]'")
    text = run("doctor").out
    assert "ROS bags: missing; pip install 'robot-oed[ros]'" in text
    if code:
        assert f"{name} is {status}" in text


@pytest.mark.parametrize(("system", "wanted"), [("linux", {"a", "b"}), ("darwin", {"a"}), ("win32", set())])
def test_doctor_expects_what_the_system_can_have(monkeypatch: pytest.MonkeyPatch, system: str, wanted: set) -> None:
    """A library that is required on other operating systems only is not missing on this one."""
    lines = ["a>=1; sys_platform != 'win32'", 'b>=2; sys_platform == "linux"']
    monkeypatch.setattr(installation, "requires", lambda _: lines)
    monkeypatch.setattr(installation.sys, "platform", system)
    assert {name for name, *_ in installation.requires_of()} == wanted


@pytest.mark.slow
def test_what_a_missing_library_hinders_is_said(tmp_path: Path) -> None:
    """Without pinocchio the benchmark says so in one message."""
    code = "import sys; sys.modules['pinocchio'] = None; from oed.cli import main; main()"
    words = [sys.executable, "-c", code, "benchmark", "make", str(tmp_path / "cases")]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "needs the package pinocchio, which is not installed" in done.stderr
    assert "pip install pin" in done.stderr
    assert "Traceback" not in done.stderr


def test_doctor_without_an_installation(run, monkeypatch: pytest.MonkeyPatch) -> None:
    """A source tree that was never installed says so."""
    assert installation.requires_of("no-such-package") == []
    monkeypatch.setattr(installation, "requires_of", list)
    done = run("doctor")
    assert done.code == 1
    assert "not installed" in done.out


def test_doctor_without_a_compiler(run, monkeypatch: pytest.MonkeyPatch) -> None:
    """No compiler is no error: it only makes designs faster."""
    monkeypatch.setattr(installation, "_compiler", lambda: None)
    done = run("doctor")
    assert done.code == 0
    assert "C compiler: none" in done.out


def test_one_effect_is_explained(run) -> None:
    """`oed effects NAME` gives the formula, the parameters and what separates it; a wrong name is answered."""
    done = run("effects", "spring")
    for text in ("tau = (p + c1 s", "lever_ratio", "static_hold: many static poses"):
        assert text in done.out
    done = run("effects", "sprin")
    assert done.code == 2
    assert "did you mean 'spring'?" in done.err

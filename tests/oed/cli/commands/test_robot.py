"""``oed robot show`` and ``oed robots``."""

from __future__ import annotations

import shlex

import pytest

from robots import loading
from robots.common.errors import DescriptionWarning
from robots.loading import catalogue, load_robot
from tests.robots.robot_files import URDF


def test_show(run, tmp_path):
    """A file is shown with its notes on standard output, and nothing on standard error; --json has the same."""
    path = tmp_path / "two.urdf"
    path.write_text(URDF.replace("</robot>", '<gazebo reference="l1"/></robot>'))
    done = run("robot", "show", path)
    assert (done.code, done.err) == (0, "")
    assert "not used from the URDF: <gazebo> (1 times)" in done.out
    data = run("robot", "show", path, "--json").data
    assert [joint["name"] for joint in data["joints"]] == ["j1", "j2"]
    assert any("not used" in note for note in data["notes"])
    assert run("robot", "show", path, "--quiet").out == ""


def test_joints_without_stops_are_shown(run, tmp_path):
    """A robot that cannot be designed for is shown all the same, and a note names what is missing."""
    path = tmp_path / "two.urdf"
    path.write_text(URDF.replace('lower="-1" upper="1" ', ""))
    done = run("robot", "show", path)
    assert done.code == 0
    assert "joint j1: no position limits stated" in done.out


@pytest.mark.parametrize(
    "choice", [{"tip": "l1"}, {"joints": ["j2"], "locked": {"j1": 0.25}}, {"tip": "l2", "locked": {"j1": 0.25}}]
)
def test_the_advice_of_a_note_shows_the_same_robot(run, tmp_path, monkeypatch, choice):
    """The command of a note can be typed as it stands, with a blank in the path, and shows the same joints."""
    monkeypatch.setattr(loading, "_warned", set())
    path = tmp_path / "my robot.urdf"
    path.write_text(URDF)
    with pytest.warns(DescriptionWarning) as caught:
        robot = load_robot(path, **choice)
    data = run("robot", "show", *shlex.split(caught[0].message.origin), "--json").data
    assert [joint["name"] for joint in data["joints"]] == list(robot.joint_names)
    assert data["sha256"] == robot.digest


def test_a_choice_of_joints(run, tmp_path):
    """--tip, --joints and --lock choose the chain."""
    path = tmp_path / "two.urdf"
    path.write_text(URDF)
    data = run("robot", "show", path, "--lock", "j2=0.05", "--json").data
    assert [joint["name"] for joint in data["joints"]] == ["j1"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("ur11",), "unknown robot 'ur11'"),
        (("none.urdf",), "none.urdf: no such file"),
        (("ur10", "--tip", "nose"), "there is no link 'nose'"),
    ],
)
def test_bad_input(arguments, message, run):
    """What cannot be read ends with exit code 2 and one message."""
    done = run("robot", "show", *arguments)
    assert done.code == 2
    assert message in done.err
    assert done.out == ""


def test_another_action(run):
    """An unknown action ends with exit code 2 and the known one."""
    done = run("robot", "draw", "ur10")
    assert done.code == 2
    assert "allowed: show" in done.err


def test_robots(run):
    """The catalogue is listed by name, as text and as data."""
    assert [row["name"] for row in run("robots", "--json").data["robots"]] == list(catalogue())
    text = run("robots").out
    assert all(name in text for name in catalogue())

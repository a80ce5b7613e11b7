"""One contract for all forms of a trajectory, and what is special to each."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml

from oed.exports import CONTROLLER_FORMS, ExportOptions, export_trajectory
from oed.exports.forms.moveit_limits import read_joint_limits
from oed.exports.forms.sampling import at_period
from robots.common.errors import AssumedValueWarning, InputError
from robots.loading import load_robot
from robots.robot import Robot
from robots.signals import Motion

ROBOTS = {"franka": "panda", "franka-player": "panda", "urscript": "ur10"}
PRECISION = {"simple-message": 2e-7, "kuka": 1e-8, "abb": 1e-8, "urscript": 1e-8}
CASES = [(name, suffix) for name, form in CONTROLLER_FORMS.items() for suffix in form.suffixes]
EACH = pytest.mark.parametrize(("name", "suffix"), CASES)


@pytest.fixture(scope="module")
def robots() -> dict[str, Robot]:
    """Load a robot for each form."""
    loaded = {robot: load_robot(robot) for robot in ("er3a", "panda", "ur10")}
    return {name: loaded[ROBOTS.get(name, "er3a")] for name in CONTROLLER_FORMS}


def motion_of(robot: Robot, period: float = 0.004, count: int = 251) -> Motion:
    """A quintic move: its samples at any period are known, and degree 5 between samples is exact."""
    T = 0.004 * 250
    s = period * np.arange(count) / T
    size = np.linspace(0.3, 0.1, robot.n)
    shape = (10 * s**3 - 15 * s**4 + 6 * s**5, (30 * s**2 - 60 * s**3 + 30 * s**4) / T)
    bend = (60 * s - 180 * s**2 + 120 * s**3) / T**2
    home = robot.limits.home
    return Motion(
        5.0 + period * np.arange(count), home + np.outer(shape[0], size), *(np.outer(x, size) for x in (shape[1], bend))
    )


@EACH
def test_reads_back(name: str, suffix: str, robots, tmp_path: Path) -> None:
    """A file holds the trajectory at the form's period, from time zero; the same input gives the same bytes."""
    robot, form = robots[name], CONTROLLER_FORMS[name]
    motion, path = motion_of(robot), tmp_path / f"trajectory{suffix}"
    export_trajectory(path, motion, robot, name)
    first = path.read_bytes()
    export_trajectory(path, motion, robot, name, force=True)
    assert path.read_bytes() == first
    if not form.has_samples:
        with pytest.raises(InputError, match="cannot be read back"):
            form.read(path.read_bytes(), robot, suffix)
        return
    t, q = form.read(path.read_bytes(), robot, suffix)
    # Programs have fewer points, as their controller's motion planner needs them.
    period = float(t[1]) if form.named else form.period_of(robot) or 0.004
    expected = motion_of(robot, period, round(1.0 / period) + 1)
    np.testing.assert_allclose(t, expected.t - 5.0, atol=1e-7)
    np.testing.assert_allclose(q, expected.q, atol=PRECISION.get(name, 1e-12))


@EACH
def test_other_period(name: str, suffix: str, robots, tmp_path: Path) -> None:
    """The period is the user's; a duration that is no multiple of it ends at rest at the last pose."""
    robot, path = robots[name], tmp_path / f"trajectory{suffix}"
    written = export_trajectory(path, motion_of(robot), robot, name, period=0.009)
    assert len(written) == 113
    np.testing.assert_array_equal(written.q[-1], motion_of(robot).q[-1])
    np.testing.assert_array_equal(written.dq[-1], 0.0)
    np.testing.assert_allclose(written.q[:-1], motion_of(robot, 0.009, 112).q, atol=1e-9)


@EACH
def test_never_overwrites(name: str, suffix: str, robots, tmp_path: Path) -> None:
    """An existing file stays without force; another suffix and another robot are refused."""
    robot, path = robots[name], tmp_path / f"trajectory{suffix}"
    path.write_text("kept")
    with pytest.raises(InputError, match="exists"):
        export_trajectory(path, motion_of(robot), robot, name)
    assert path.read_text() == "kept"
    export_trajectory(path, motion_of(robot), robot, name, force=True)
    assert path.read_text("latin-1") != "kept"
    with pytest.raises(InputError, match="allowed: \\."):
        export_trajectory(tmp_path / "a.txt", motion_of(robot), robot, name)
    fewer = motion_of(robot)
    with pytest.raises(InputError, match="1 joints"):
        export_trajectory(
            tmp_path / f"trajectory{suffix}",
            Motion(fewer.t, fewer.q[:, :1], fewer.dq[:, :1], fewer.ddq[:, :1]),
            robot,
            name,
        )


@EACH
def test_foreign_content(name: str, suffix: str, robots) -> None:
    """A file of another form is one error."""
    for content in (b"", b"\xff\xfe\x00", b"hello: {", b"[1, 2]"):
        with pytest.raises(InputError):
            CONTROLLER_FORMS[name].read(content, robots[name], suffix)


def test_ros_message(robots, tmp_path: Path) -> None:
    """The ROS message names the robot's joints, and YAML and JSON say the same."""
    robot = robots["ros"]
    for suffix in (".yaml", ".json"):
        export_trajectory(tmp_path / f"t{suffix}", motion_of(robot), robot, "ros")
        export_trajectory(tmp_path / f"g{suffix}", motion_of(robot), robot, "ros-goal")
    message = json.loads((tmp_path / "t.json").read_text())
    assert message == yaml.safe_load((tmp_path / "t.yaml").read_text())
    assert message["joint_names"] == list(robot.joint_names)
    assert set(message["points"][0]) == {"positions", "velocities", "accelerations", "effort", "time_from_start"}
    assert message["points"][250]["time_from_start"] == {"sec": 1, "nanosec": 0}
    goal = json.loads((tmp_path / "g.json").read_text())
    assert goal["trajectory"] == message
    assert [tolerance["name"] for tolerance in goal["goal_tolerance"]] == list(robot.joint_names)


def test_ros_joints_in_another_order(robots, tmp_path: Path) -> None:
    """Joints are found by name."""
    robot, path = robots["ros"], tmp_path / "t.json"
    motion = export_trajectory(path, motion_of(robot), robot, "ros")
    message = json.loads(path.read_text())
    message["joint_names"].reverse()
    for point in message["points"]:
        point["positions"].reverse()
    _, q = CONTROLLER_FORMS["ros"].read(json.dumps(message).encode(), robot, ".json")
    np.testing.assert_array_equal(q, motion.q)
    message["joint_names"][0] = "elbow"
    with pytest.raises(InputError, match="no JointTrajectory of er3a"):
        CONTROLLER_FORMS["ros"].read(json.dumps(message).encode(), robot, ".json")


def test_moveit_limits(robots, tmp_path: Path) -> None:
    """MoveIt's file has the robot's limits, none where there is none, and reads back."""
    robot = robots["moveit-limits"]
    limits = replace(robot.limits, jerk=np.array([np.inf, *robot.limits.jerk[1:]]))
    changed = replace(robot, limits=limits)
    export_trajectory(tmp_path / "l.yaml", motion_of(robot), changed, "moveit-limits")
    content = (tmp_path / "l.yaml").read_bytes()
    read = read_joint_limits(content, changed)
    for quantity in ("velocity", "acceleration", "jerk"):
        np.testing.assert_array_equal(read[quantity], getattr(limits, quantity))
    for damage, problem in (
        (b"max_velocity: [1]", "max_velocity is"),
        (b"max_velocity: -1.0", "max_velocity is -1"),
    ):
        with pytest.raises(InputError, match=problem):
            read_joint_limits(re.sub(rb"max_velocity: [\d.]+", damage, content), changed)
    with pytest.raises(InputError, match="no joint_limits"):
        read_joint_limits(b"a: 1", changed)
    with pytest.raises(InputError, match="no limits of"):
        read_joint_limits(b"joint_limits: {}", changed)


def test_urscript_has_the_period_of_its_controller(robots, tmp_path: Path) -> None:
    """A CB controller gets commands of 8 ms, one of the e-series 2 ms; another period, or a shorter one, is noted."""
    cb = robots["urscript"]
    for robot, period in ((cb, 0.008), (replace(cb, period=0.002), 0.002)):
        path = tmp_path / f"{period}.script"
        export_trajectory(path, motion_of(robot), robot, "urscript")
        assert re.findall(r"0, 0, ([\d.]+), 0.1, 300\)", path.read_text()) == [str(period)] * (round(1.0 / period) + 2)
    with pytest.warns(AssumedValueWarning, match="4 ms, which is none of a UR controller: 2 ms of the e-series"):
        assert (
            export_trajectory(tmp_path / "a.script", motion_of(cb), replace(cb, period=0.004), "urscript").period
            == 0.002
        )
    with pytest.warns(AssumedValueWarning, match="commands of 2 ms are shorter than the cycle"):
        export_trajectory(tmp_path / "b.script", motion_of(cb), cb, "urscript", period=0.002)


def test_urscript_guards_its_start(robots, tmp_path: Path) -> None:
    """The program compares the pose with the first point before any motion command, and ends at rest."""
    robot, path = robots["urscript"], tmp_path / "p.script"
    export_trajectory(
        path, motion_of(robot), robot, "urscript", options=ExportOptions(start_tolerance=0.02, name="excite")
    )
    lines = path.read_text().splitlines()
    assert lines[0] == "def excite():"
    assert lines[-2:] == ["  stopj(2.0)", "end"]
    guard = next(k for k, line in enumerate(lines) if "> 0.02" in line)
    assert guard < lines.index("      halt") < next(k for k, line in enumerate(lines) if "servoj" in line)


@pytest.mark.parametrize(("name", "problem"), [("urscript", "allowed: 6"), ("kuka", "1 to 6"), ("abb", "1 to 6")])
def test_wrong_number_of_joints(name: str, problem: str, robots, tmp_path: Path) -> None:
    """A controller's form refuses a robot that it cannot have."""
    panda = robots["franka"]
    with pytest.raises(InputError, match=problem):
        export_trajectory(tmp_path / f"trajectory{CONTROLLER_FORMS[name].suffixes[0]}", motion_of(panda), panda, name)
    with pytest.raises(InputError, match="allowed: 7"):
        export_trajectory(tmp_path / "a.csv", motion_of(robots["ros"]), robots["ros"], "franka")


@pytest.mark.parametrize("period", [0.0, -0.1, float("nan"), 1e-9])
def test_wrong_periods(period: float, robots) -> None:
    """A period that is not positive, or gives too many samples, is refused."""
    with pytest.raises(InputError):
        at_period(motion_of(robots["ros"]), period)


@pytest.mark.parametrize("settings", [{"start_tolerance": 0.0}, {"name": "no name"}, {"name": "böse"}])
def test_wrong_options(settings) -> None:
    """A tolerance of zero and a name that no program can have are refused."""
    with pytest.raises(InputError):
        ExportOptions(**settings)


def test_unknown_form(robots, tmp_path: Path) -> None:
    """A form that does not exist is refused with those that do."""
    with pytest.raises(InputError, match="urscript"):
        export_trajectory(tmp_path / "a.csv", motion_of(robots["ros"]), robots["ros"], "fanuc")

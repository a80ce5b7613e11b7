"""``oed retime`` on lists of waypoints, as its user calls it."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from oed.exports import read_trajectory

SCARA = """\
name: scara
geometry:
  convention: modified
  joints:
    - {name: turn, d: 0.3}
    - {name: slide, a: 0.3, kind: prismatic}
limits:
  position: {lower: [-114.6, -0.1], upper: [114.6, 0.1], unit: [deg, m]}
  velocity: {values: [2, 0.5], unit: [rad/s, m/s]}
  acceleration: {values: [10, 3], unit: [rad/s2, m/s2], source: assumed}
  jerk: {values: [200, 60], unit: [rad/s3, m/s3], source: assumed}
"""


def block(*units: str) -> str:
    """The block of a CSV that states the units of its columns."""
    rows = [f"# - {{name: q{joint}, unit: {unit}, datatype: float64}}\n" for joint, unit in enumerate(units, start=1)]
    return "".join(["# %ECSV 1.0\n# ---\n# delimiter: ','\n# datatype:\n", *rows])


def passes(q: np.ndarray, points: list[list[float]], step: float) -> bool:
    """Whether positions pass the points in their order, up to half a step."""
    nearest = [np.abs(q - point).max(axis=1) for point in points]
    rows = [int(away.argmin()) for away in nearest]
    return rows == sorted(rows) and max(away.min() for away in nearest) <= step / 2 + 1e-9


@pytest.mark.slow
@pytest.mark.parametrize(
    ("text", "method"),
    [
        ("q1,q2\n0,0\n0.5,0.3\n1,-0.5\n", "toppra"),
        ("name,q2,q1\na,0,0\nb,0.3,0.5\nc,-0.5,1\n", "ruckig"),
        (block("deg", "rad") + "q1,q2\n0,0\n28.64788975654116,0.3\n57.29577951308232,-0.5\n", "ruckig"),
    ],
)
def test_waypoints(text: str, method: str, run: Callable[..., Any], robot: Path, tmp_path: Path) -> None:
    """Waypoints in rad or stated degrees, in any order of the columns, become a trajectory through all of them."""
    points = [[0.0, 0.0], [0.5, 0.3], [1.0, -0.5]]
    (tmp_path / "points.csv").write_text(text)
    out = tmp_path / "timed"
    done = run("retime", tmp_path / "points.csv", "--robot", robot, "--method", method, "--out", out, "--json")
    assert done.code == 0, done.err
    motion, metadata = read_trajectory(out / "trajectory.csv")
    assert Path(metadata["robot"]).stem == "two"
    assert passes(motion.q, points, 0.004 * 2)
    np.testing.assert_allclose(motion.q[[0, -1]], [points[0], points[-1]], atol=1e-6)
    assert np.abs(motion.dq).max() <= 2 + 1e-6
    assert json.loads((out / "design.json").read_text())["robot"]["name"] == "two"
    again = run("retime", tmp_path / "points.csv", "--robot", robot, "--method", method, "--out", out)
    assert (again.code, "the file exists" in again.err) == (2, True)


@pytest.mark.slow
def test_linear_axes(run: Callable[..., Any], tmp_path: Path) -> None:
    """Degrees and millimetres of a SCARA become rad and m, and the trajectory states them."""
    (tmp_path / "scara.yaml").write_text(SCARA)
    (tmp_path / "points.csv").write_text(block("deg", "mm") + "q1,q2\n0,0\n90,50\n-45,-80\n")
    out = tmp_path / "timed"
    done = run(
        "retime", tmp_path / "points.csv", "--robot", tmp_path / "scara.yaml", "--method", "ruckig", "--out", out
    )
    assert done.code == 0, done.err
    motion, metadata = read_trajectory(out / "trajectory.csv")
    assert metadata["kinds"] == ["revolute", "prismatic"]
    assert passes(motion.q, [[0.0, 0.0], [np.pi / 2, 0.05], [-np.pi / 4, -0.08]], 0.004 * 2)
    (tmp_path / "points.csv").write_text(block("deg", "deg") + "q1,q2\n0,0\n90,50\n")
    done = run("retime", tmp_path / "points.csv", "--robot", tmp_path / "scara.yaml", "--out", tmp_path / "other")
    assert (done.code, "column q2: unit 'deg' of a prismatic joint of scara; allowed: m or mm" in done.err) == (2, True)


@pytest.mark.parametrize(
    ("text", "code", "problem"),
    [
        ("q1,q2\n0,0\n", 2, "points.csv: 1 waypoint; allowed: two or more"),
        ("q1\n0\n1\n", 2, "found q1; allowed: q1 to q2"),
        ("q1,q2,q3\n0,0,0\n1,1,1\n", 2, "found q1, q2, q3; allowed: q1 to q2"),
        ("x,y\n0,0\n1,1\n", 2, "found no columns q1, q2, ..."),
        ("q1,q2\n0,0\n1,nan\n", 2, "column q2, row 3"),
        ("q1,q2\n0,0\n1,-2.5\n", 2, "column q2, row 3: -2.5 rad is outside the limits of two; allowed: -2 to 2 rad"),
        ("q1,q2\n30,20\n60,-40\n", 2, "column q1, row 2: 30 rad is outside .* states deg"),
        (
            block("m", "m") + "q1,q2\n0,0\n1,1\n",
            2,
            "column q1: unit 'm' of a revolute joint of two; allowed: rad or deg",
        ),
        ("q1,q2\n0.5,0.5\n0.5,0.5\n", 1, "no motion"),
        ("q1,q2\n0,0\n1.99,0.3\n1.9,1.9\n-1.99,1.99\n", 1, "joint 1: the position 2.0.* swings out .*--method ruckig"),
    ],
)
def test_wrong_waypoints(
    text: str, code: int, problem: str, run: Callable[..., Any], robot: Path, tmp_path: Path
) -> None:
    """Wrong waypoints are one message with file, column and row, and nothing is written."""
    (tmp_path / "points.csv").write_text(text)
    done = run("retime", tmp_path / "points.csv", "--robot", robot, "--out", tmp_path / "timed", "--quiet")
    assert done.code == code, done.err
    assert len(done.err.splitlines()) == 1
    assert re.search(problem, done.err), done.err
    assert not (tmp_path / "timed").exists()


def test_waypoints_need_a_robot(run: Callable[..., Any], tmp_path: Path) -> None:
    """A list of waypoints does not name its robot."""
    (tmp_path / "points.csv").write_text("q1,q2\n0,0\n1,1\n")
    done = run("retime", tmp_path / "points.csv", "--out", tmp_path / "timed")
    assert (done.code, "give --robot" in done.err) == (2, True)


TURN3 = """<robot name="turn3"><link name="base"/><link name="a"/><link name="b"/><link name="c"/>
<joint name="pan" type="continuous"><parent link="base"/><child link="a"/><origin xyz="0 0 0.2"/><axis xyz="0 0 1"/>
<limit velocity="2" effort="60"/></joint>
<joint name="lift" type="revolute"><parent link="a"/><child link="b"/><origin xyz="0 0 0.1" rpy="1.5707963 0 0"/>
<axis xyz="0 0 1"/><limit lower="-2" upper="2" velocity="2" effort="80"/></joint>
<joint name="elbow" type="continuous"><parent link="b"/><child link="c"/><origin xyz="0.4 0 0"/><axis xyz="0 0 1"/>
<limit velocity="2" effort="30"/></joint></robot>"""


@pytest.mark.slow
@pytest.mark.parametrize("method", ["toppra", "ruckig"])
def test_continuous_joints_pass_pi_the_shorter_way(method: str, run: Callable[..., Any], tmp_path: Path) -> None:
    """From 3.1 to -3.0 rad a continuous joint turns by 0.18 rad, not by 6.1 rad back; one note says so."""
    (tmp_path / "turn3.urdf").write_text(TURN3)
    (tmp_path / "way.csv").write_text("q1,q2,q3\n2.8,0.2,0.0\n3.1,0.3,0.2\n-3.0,0.4,0.4\n-2.6,0.5,0.6\n")
    robot, out = tmp_path / "turn3.urdf", tmp_path / "r"
    done = run("retime", tmp_path / "way.csv", "--robot", robot, "--method", method, "--out", out)
    assert done.code == 0, done.err
    assert done.err.count("joint pan. For the longer way, put a waypoint between") == 1
    motion, _ = read_trajectory(out / "trajectory.csv")
    # 0.3 rad, 2 pi - 6.1 rad and 0.4 rad, all in one direction.
    np.testing.assert_allclose(np.abs(np.diff(motion.q[:, 0])).sum(), 2 * np.pi - 5.4, rtol=1e-9)

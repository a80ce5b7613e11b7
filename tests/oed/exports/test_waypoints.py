"""Lists of waypoints as files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from oed.exports import read_waypoints, shorter_way
from robots.common.errors import InputError, ShorterWayWarning
from robots.geometry.chain import Chain, Joint
from robots.limits import Limits
from robots.robot import Robot

UNITS = """# %ECSV 1.0
# ---
# delimiter: ","
# datatype:
# - {name: q1, unit: deg, datatype: float64}
# - {name: q2, unit: mm, datatype: float64}
"""


def written(folder: Path, text: str) -> Path:
    """Write a file."""
    path = folder / "points.csv"
    path.write_text(text)
    return path


def test_positions_in_the_order_of_the_joints(tmp_path: Path) -> None:
    """Columns may stand in any order, others are left out, and stated units are converted."""
    plain = read_waypoints(written(tmp_path, "q2,name,q1\n0.5,a,1\n-0.5,b,2\n"), 2)
    np.testing.assert_array_equal(plain, [[1.0, 0.5], [2.0, -0.5]])
    np.testing.assert_array_equal(read_waypoints(written(tmp_path, "q1\n0\n1\n")), [[0.0], [1.0]])
    stated = read_waypoints(written(tmp_path, UNITS + "q1,q2\n180,500\n-90,0\n"), 2)
    np.testing.assert_allclose(stated, [[np.pi, 0.5], [-np.pi / 2, 0.0]], rtol=1e-15)


def test_a_trajectory_is_no_list_of_waypoints(tmp_path: Path) -> None:
    """A file with times is a trajectory."""
    assert read_waypoints(written(tmp_path, "t,q1\n0,0\n1,1\n"), 1) is None


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("q1\n0\n1\n", "found q1; allowed: q1 to q2"),
        ("q1,q3\n0,0\n1,1\n", "found q1, q3"),
        ("a,b\n0,0\n1,1\n", "no columns q1"),
        ("q1,q2\n0,0\n", "1 waypoint; allowed: two or more"),
        ("q1,q2\n0,0\n1,nan\n", "column q2, row 3"),
        ("q1,q2\n0,0\n1,x\n", "q2"),
        (UNITS.replace("mm", "inch") + "q1,q2\n0,0\n1,1\n", "unit 'inch'"),
    ],
)
def test_wrong_files(text: str, problem: str, tmp_path: Path) -> None:
    """Another number of joints, text, a missing value or an unknown unit is one message with its place."""
    with pytest.raises(InputError, match=problem):
        read_waypoints(written(tmp_path, text), 2)


@pytest.fixture
def turner() -> Robot:
    """An endless joint, one with limits of two turns, and an endless slide."""
    kinds = ("revolute", "revolute", "prismatic")
    joints = tuple(Joint(name, kind, np.eye(3), np.zeros(3)) for name, kind in zip("abc", kinds, strict=True))
    ends, free = np.array([np.inf, 6.3, np.inf]), np.full(3, np.inf)
    limits = Limits(lower=-ends, upper=ends, velocity=np.ones(3), acceleration=free, jerk=free, torque=free)
    return Robot(name="turner", chain=Chain(joints), limits=limits)


def test_endless_joints_turn_the_shorter_way(turner: Robot, tmp_path: Path) -> None:
    """Angles within one turn that pass pi, or zero, go on; other joints keep theirs; one note names the joint."""
    text = "q1,q2,q3\n2.8,2.8,2.8\n3.1,3.1,3.1\n-3.0,-3.0,-3.0\n-2.6,-2.6,-2.6\n"
    with pytest.warns(ShorterWayWarning, match=r"first from 2 to 3, the shorter way .*: joint a\.") as caught:
        q = read_waypoints(written(tmp_path, text), robot=turner)
    assert len(caught) == 1
    np.testing.assert_allclose(q[:, 0], [2.8, 3.1, 2 * np.pi - 3.0, 2 * np.pi - 2.6], rtol=1e-15)
    np.testing.assert_array_equal(q[:, 1:], np.array([[2.8, 3.1, -3.0, -2.6]] * 2).T)
    with pytest.warns(ShorterWayWarning, match="first from 1 to 2"):
        q = shorter_way(turner, [[0.1, 0, 0], [6.2, 0, 0], [0.2, 0, 0]])
    np.testing.assert_allclose(q[:, 0], [0.1, 6.2 - 2 * np.pi, 0.2], atol=1e-15)


@pytest.mark.parametrize("angles", [[0.0, 3.0, -0.1], [0.0, 7.0, 0.0], [0.0, np.pi, 0.0], [-9.0, -2.0, 4.0]])
def test_counted_turns_and_short_ways_stay(turner: Robot, angles: list[float]) -> None:
    """Angles that span more than a turn count turns: they stay, as do steps of up to half a turn, without a note."""
    q = np.array([angles, [0.0] * 3, [0.0] * 3]).T
    np.testing.assert_array_equal(shorter_way(turner, q), q)

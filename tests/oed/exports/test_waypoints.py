"""Lists of waypoints as files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from oed.exports import read_waypoints
from robots.common.errors import InputError

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

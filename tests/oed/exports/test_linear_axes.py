"""Linear axes stay in metres in every form of a trajectory."""

import numpy as np
import pytest

from oed.exports import read_trajectory, write_trajectory
from robots.common.errors import InputError
from robots.common.tables.table_files import read_table
from robots.signals import Motion

KINDS = ("revolute", "prismatic", "revolute")


def motion(n: int = 3) -> Motion:
    """Slow waves that rest at no end; derivatives in closed form."""
    t = 0.004 * np.arange(101)
    rate = np.arange(1, n + 1)
    phase = t[:, None] * rate
    return Motion(t, 0.1 * np.sin(phase), 0.1 * rate * np.cos(phase), -0.1 * rate**2 * np.sin(phase))


@pytest.mark.parametrize("degrees", [False, True])
def test_units_by_joint(degrees, tmp_path):
    """The block states m, m/s and m/s2 of a linear axis; degrees are for angles alone; both read back the same."""
    path = tmp_path / "t.csv"
    write_trajectory(path, motion(), kinds=KINDS, degrees=degrees)
    table = read_table(path)
    angle = "deg" if degrees else "rad"
    assert [table.units[f"q{j}"] for j in (1, 2, 3)] == [angle, "m", angle]
    assert (table.units["dq2"], table.units["ddq2"], table.units["ddq3"]) == ("m/s", "m/s2", f"{angle}/s2")
    np.testing.assert_array_equal(table.columns["q2"], motion().q[:, 1])
    np.testing.assert_allclose(table.columns["dq3"], motion().dq[:, 2] * (180 / np.pi if degrees else 1), rtol=1e-15)
    back, stated = read_trajectory(path)
    assert tuple(stated["kinds"]) == KINDS
    np.testing.assert_allclose(back.q, motion().q, rtol=0, atol=1e-15)


def test_kinds_pass_from_file_to_file(tmp_path):
    """What a file states of its axes holds for the file that is made of it, though no block says so again."""
    write_trajectory(tmp_path / "a.csv", motion(), {"robot": "r"}, kinds=KINDS)
    back, stated = read_trajectory(tmp_path / "a.csv")
    write_trajectory(tmp_path / "b.csv", back, stated, degrees=True, bare=True)
    rows = np.loadtxt(tmp_path / "b.csv", delimiter=",", skiprows=1)
    np.testing.assert_array_equal(rows[:, 2], motion().q[:, 1])
    np.testing.assert_allclose(rows[:, 3], np.rad2deg(motion().q[:, 2]), rtol=1e-15)
    write_trajectory(tmp_path / "c.csv", back, stated)
    assert "kinds" not in read_table(tmp_path / "c.csv").metadata


def test_millimetres_become_metres(tmp_path):
    """A file in millimetres reads in metres; a unit that is none of a length or angle is refused with its column."""
    path = tmp_path / "t.csv"
    write_trajectory(path, motion(), kinds=KINDS)
    lines = path.read_text().splitlines()
    rows = [line for line in lines if not line.startswith("#")]
    scaled = [rows[0]]
    for row in rows[1:]:
        values = [float(value) for value in row.split(",")]
        for column in (2, 5, 8):
            values[column] *= 1000
        scaled.append(",".join(map(repr, values)))
    head = [line.replace("unit: m", "unit: mm") for line in lines if line.startswith("#")]
    path.write_text("\n".join(head + scaled) + "\n")
    np.testing.assert_allclose(read_trajectory(path)[0].ddq, motion().ddq, rtol=1e-12, atol=1e-15)
    path.write_text("\n".join(head + scaled).replace("unit: mm/s2", "unit: g") + "\n")
    with pytest.raises(InputError, match=r"column ddq2: unit 'g'; allowed: rad/s2, deg/s2, m/s2, mm/s2"):
        read_trajectory(path)


def test_a_kind_for_each_joint(tmp_path):
    """Kinds of another number of joints are refused."""
    with pytest.raises(InputError, match=r"2 joint kinds; allowed: 3"):
        write_trajectory(tmp_path / "t.csv", motion(), kinds=KINDS[:2])

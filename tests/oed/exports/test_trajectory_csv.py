from dataclasses import replace

import numpy as np
import pytest

from oed.exports import read_trajectory, write_trajectory
from robots.common.errors import InputError, ShorterWayWarning
from robots.signals import Motion

PERIOD = 0.004


def _motion(n: int = 2, count: int = 501) -> Motion:
    t = PERIOD * np.arange(count)
    rate = np.pi * np.arange(1, n + 1)
    phase = t[:, None] * rate
    return Motion(t, 1 - np.cos(phase), rate * np.sin(phase), rate**2 * np.cos(phase))


def _lines(path) -> tuple[list[str], list[list[str]]]:
    lines = path.read_text().splitlines()
    block = [line for line in lines if line.startswith("#")]
    return block, [line.split(",") for line in lines[len(block) :]]


def _rewrite(path, change) -> None:
    """Lets `change` edit the header and the rows of a file."""
    block, rows = _lines(path)
    change(rows)
    path.write_text("\n".join([*block, *(",".join(row) for row in rows)]) + "\n")


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "trajectory.csv"
    write_trajectory(path, _motion(), {"robot": "er3a"})
    return path


def test_what_is_written_reads_back_exactly(file):
    """Times, positions, velocities and accelerations read back to the last bit, and so does what the block states."""
    motion, metadata = read_trajectory(file, n=2)
    expected = _motion()
    for name in ("t", "q", "dq", "ddq"):
        np.testing.assert_array_equal(getattr(motion, name), getattr(expected, name))
    assert metadata["robot"] == "er3a"
    assert metadata["period"] == pytest.approx(PERIOD)


def test_the_file_has_the_contract_s_form(file):
    """An ECSV block comes first, then the header t,q1..qn,dq1..dqn,ddq1..ddqn."""
    block, rows = _lines(file)
    assert block[0].startswith("# %ECSV")
    assert rows[0] == ["t", "q1", "q2", "dq1", "dq2", "ddq1", "ddq2"]
    assert len(rows) == 502


def test_degrees_are_written_on_request_and_read_back_as_radians(tmp_path):
    """A file in degrees says so in its block, and reads back in radians."""
    path = tmp_path / "degrees.csv"
    write_trajectory(path, _motion(), degrees=True)
    _, rows = _lines(path)
    assert float(rows[251][1]) == pytest.approx(np.rad2deg(_motion().q[250, 0]))
    motion, _ = read_trajectory(path)
    np.testing.assert_allclose(motion.ddq, _motion().ddq, rtol=1e-14)


def test_bare_files_have_a_header_and_numbers_only(tmp_path):
    """A bare file starts with its header, and reads back exactly all the same."""
    path = tmp_path / "bare.csv"
    write_trajectory(path, _motion(), bare=True)
    assert path.read_text().startswith("t,q1,q2,dq1")
    motion, metadata = read_trajectory(path)
    np.testing.assert_array_equal(motion.q, _motion().q)
    assert metadata == {}


def test_positions_only_is_for_controllers(tmp_path):
    """A file of positions has no other columns; reading it as a trajectory names the first one missing."""
    path = tmp_path / "positions.csv"
    write_trajectory(path, _motion(), positions_only=True, bare=True)
    assert path.read_text().startswith("t,q1,q2\n")
    with pytest.raises(InputError, match="column dq1"):
        read_trajectory(path)


@pytest.mark.parametrize("bare", [True, False])
def test_files_are_not_overwritten_without_force(tmp_path, bare):
    """An existing file stays unless force is given."""
    path = tmp_path / "trajectory.csv"
    path.write_text("mine")
    with pytest.raises(InputError):
        write_trajectory(path, _motion(), bare=bare)
    assert path.read_text() == "mine"
    write_trajectory(path, _motion(), bare=bare, force=True)
    assert len(read_trajectory(path)[0]) == 501


def test_uneven_motions_are_not_written(tmp_path):
    """A motion with uneven steps is no trajectory for a controller."""
    t = np.array([0.0, 0.004, 0.009])
    with pytest.raises(InputError, match="uniform"):
        write_trajectory(tmp_path / "x.csv", Motion(t, *np.zeros((3, 3, 1))))


def _drop_column(rows):
    for row in rows:
        del row[4]


def _set(row: int, column: int, value: str):
    def change(rows):
        rows[row + 1][column] = value

    return change


def _swap_times(rows):
    rows[101][0], rows[102][0] = rows[102][0], rows[101][0]


def _skip_rows(rows):
    del rows[200:203]


def _scale(column: int, factor: float):
    def change(rows):
        for row in rows[1:]:
            row[column] = repr(float(row[column]) * factor)

    return change


def _no_joints(rows):
    rows[0] = ["t", "a", "b", "c", "d", "e", "f"]


@pytest.mark.parametrize(
    ("change", "column", "row", "message"),
    [
        (_drop_column, "dq2", None, "missing"),
        (_set(7, 3, "nan"), "dq1", 7, "finite"),
        (_set(7, 3, ""), "dq1", 7, "finite"),
        (_set(9, 5, "inf"), "ddq1", 9, "finite"),
        (_set(3, 2, "fast"), "q2", 3, "fast"),
        (_swap_times, "t", 101, "does not advance"),
        (_skip_rows, "t", 199, "uniform period"),
        (_set(250, 1, "3.0"), "dq1", 250, "is not the derivative"),
        (_scale(3, 57.29577951308232), "dq1", None, "is not the derivative"),
        (_scale(6, 1.5), "ddq2", None, "is not the derivative"),
        (_no_joints, None, None, "no joint columns"),
    ],
    ids=["missing", "nan", "empty", "inf", "text", "backward", "uneven", "jump", "degrees", "acceleration", "nameless"],
)
def test_bad_files_are_refused_with_column_and_line(file, change, column, row, message):
    """A missing column, NaN, text, backward or uneven time and columns that contradict each other name their place."""
    block, _ = _lines(file)
    _rewrite(file, change)
    with pytest.raises(InputError, match=message) as caught:
        read_trajectory(file)
    assert caught.value.exit_code == 2
    assert str(file) in str(caught.value)
    if column is not None:
        assert caught.value.column == column
    if row is not None:
        # Line numbers count from 1, below the block and the header.
        assert caught.value.row == len(block) + 2 + row


def test_another_number_of_joints_is_refused(file):
    """A file for another robot is an error, whether it has too many joints or too few."""
    with pytest.raises(InputError, match="column q3"):
        read_trajectory(file, n=3)
    with pytest.raises(InputError, match="2 joints"):
        read_trajectory(file, n=1)


def test_rounded_files_are_accepted(file):
    """Six decimals and whole microseconds are no contradiction."""

    def change(rows):
        for row in rows[1:]:
            row[:] = [f"{float(value):.6f}" for value in row]

    _rewrite(file, change)
    np.testing.assert_allclose(read_trajectory(file)[0].q, _motion().q, atol=1e-6)


def test_other_columns_are_ignored(file):
    """A file may carry more columns, such as segment numbers, and even text."""

    def change(rows):
        for index, row in enumerate(rows):
            row.append("note" if index == 0 else "fourier")

    _, rows = _lines(file)
    change(rows)
    file.write_text("\n".join(",".join(row) for row in rows) + "\n")
    assert read_trajectory(file)[0].n == 2


def test_a_single_sample_is_no_trajectory(file):
    """One row moves nothing."""

    def change(rows):
        del rows[2:]

    _rewrite(file, change)
    with pytest.raises(InputError, match="one sample"):
        read_trajectory(file)


@pytest.mark.parametrize("degrees", [False, True])
def test_angles_that_go_round_are_taken_on(tmp_path, degrees):
    """Positions that jump by whole turns while the velocities go on are one motion; a note names row and joints."""
    t = np.linspace(0.0, 4.0, 1001)
    speed = 4.0 * np.sin(np.pi * t / 4) ** 2
    travel = np.column_stack([2 * t - 2 * np.sin(np.pi * t / 2) / (np.pi / 2), np.zeros_like(t)])
    rise = np.pi * np.sin(np.pi * t / 2)
    motion = Motion(t, travel, np.column_stack([speed, 0 * t]), np.column_stack([rise, 0 * t]))
    wrapped = replace(motion, q=(travel + np.pi) % (2 * np.pi) - np.pi)
    path = tmp_path / "wrapped.csv"
    write_trajectory(path, wrapped, degrees=degrees)
    with pytest.warns(ShorterWayWarning, match=r"row \d+: the angle of joint 1 jumps by -360 degrees .* \(joint 1\)"):
        read, _ = read_trajectory(path)
    np.testing.assert_allclose(read.q, travel, atol=1e-12)

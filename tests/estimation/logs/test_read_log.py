import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from estimation.logs import read_log, read_logs, write_log
from robots.common.errors import InputError
from robots.signals import Log
from tests.estimation.logs.made_logs import columns, csv, refused, text


@pytest.fixture(params=["csv", "parquet"])
def save(request, tmp_path):
    """Saves columns by pyarrow or as plain text; returns the path and the row number of the first sample."""

    def to_file(data):
        path = tmp_path / f"log.{request.param}"
        if request.param == "csv":
            path.write_text(text(data, "# units: rad\n"))
            return path, 3
        pq.write_table(pa.table({name: pa.array(list(values)) for name, values in data.items()}), path)
        return path, 1

    return to_file


def spoil(values, *spots):
    values = np.array(values, dtype=float)
    for index, value in spots:
        values[index] = value
    return values


def test_time_position_and_torque_are_enough(save):
    """A log of t, q and tau only is read whole, under the name of its file."""
    path, _ = save(columns())
    log = read_log(path, n=2)
    assert (log.n, len(log), log.period, log.name) == (2, 4, 0.5, "log")
    assert log.q[:, 1].tolist() == columns()["q2"].tolist()
    assert log.tau[:, 0].tolist() == columns()["tau1"].tolist()
    assert (log.current, log.dq, log.ddq, log.temperature, log.ambient, log.qlink) == (None,) * 6
    assert log.metadata == {"file": str(path), "ignored_columns": []}


def test_every_optional_column_is_read(save):
    """Current, velocities, accelerations, temperatures, link positions, segment and cycle find their fields."""
    optional = {
        "current": {"i1": [1.0] * 4, "i2": [2.0] * 4},
        "dq": {"dq1": [3.0] * 4, "dq2": [4.0] * 4},
        "ddq": {"ddq1": [5.0] * 4, "ddq2": [6.0] * 4},
        "temperature": {"temp1": [7.0] * 4, "temp2": [8.0] * 4},
        "qlink": {"qlink1": [9.0] * 4, "qlink2": [10.0] * 4},
    }
    more = {name: values for group in optional.values() for name, values in group.items()}
    path, _ = save(columns(**more, temp_env=[20.5] * 4, segment=[0, 0, 1, 1], cycle=[3, 3, 3, 3]))
    log = read_log(path)
    for name, group in optional.items():
        np.testing.assert_array_equal(getattr(log, name), np.column_stack(list(group.values())))
    assert (log.ambient.tolist(), log.segment.tolist(), log.cycle.tolist()) == ([20.5] * 4, [0, 0, 1, 1], [3] * 4)


def test_current_stands_in_for_torque(save):
    """A log of currents only is a log without torque."""
    path, _ = save(columns(tau1=None, tau2=None, i1=[1.0] * 4, i2=[2.0] * 4))
    log = read_log(path)
    assert not log.has_torque
    assert log.current[0].tolist() == [1.0, 2.0]


def test_order_of_columns_does_not_matter(save):
    """Columns are found by name; ten joints are in the order of their numbers."""
    data = columns(joints=10)
    path, _ = save(dict(reversed(data.items())))
    np.testing.assert_array_equal(read_log(path).q, np.column_stack([data[f"q{joint}"] for joint in range(1, 11)]))


def test_other_columns_are_listed_and_not_looked_at(save):
    """Columns that are no part of a log may hold anything; their names are kept."""
    path, _ = save(columns(note=["start", "", "1", "x"], Q1=["a"] * 4, tau_cmd=[1.0] * 4, q=[0.0] * 4, t1=[2.0] * 4))
    assert read_log(path).metadata["ignored_columns"] == ["note", "Q1", "tau_cmd", "q", "t1"]


def test_silent_temperature_sensors_are_accepted(save):
    """NaN temperatures stay NaN, also of a joint without a sensor."""
    path, _ = save(columns(temp2=[20.0, np.nan, 21.0, 22.0], temp_env=[np.nan] * 4))
    log = read_log(path)
    np.testing.assert_array_equal(log.temperature[:, 0], [np.nan] * 4)
    np.testing.assert_array_equal(log.temperature[:, 1], [20.0, np.nan, 21.0, 22.0])
    assert np.isnan(log.ambient).all()


@pytest.mark.parametrize("missing", ["q1", "q3", "tau1", "tau3", "t"])
def test_missing_column_is_named(save, missing):
    """A gap in q1..q6 or tau1..tau6, or no time, names the missing column."""
    path, first = save(columns(joints=6, **{missing: None}))
    error = refused(path)
    assert (error.column, error.row) == (missing, first - 1 or None)
    assert "missing" in error.problem


def test_fewer_torques_than_positions_name_the_first_missing(save):
    """tau1..tau4 beside q1..q6 is a missing tau5, and the message lists what is there."""
    path, _ = save(columns(joints=6, tau5=None, tau6=None))
    error = refused(path)
    assert error.column == "tau5"
    assert "tau1, tau2, tau3, tau4" in error.problem
    assert "q1..q6" in error.allowed


def test_link_encoders_of_some_joints_are_read(save):
    """A joint without an encoder behind its gear has no column, and is NaN in the log."""
    path, _ = save(columns(joints=3, qlink2=[1.0, 2.0, 3.0, 4.0]))
    log = read_log(path)
    assert log.qlink[:, 1].tolist() == [1.0, 2.0, 3.0, 4.0]
    assert np.isnan(log.qlink[:, [0, 2]]).all()


def test_torque_of_a_joint_without_position_is_refused(save):
    """More torques than positions name the first one too many."""
    path, _ = save(columns(tau3=[0.0] * 4))
    error = refused(path)
    assert error.column == "tau3"
    assert "no q3" in error.problem


def test_no_position_at_all_is_a_missing_q1(save):
    """A log without positions names q1."""
    path, _ = save(columns(q1=None, q2=None))
    assert refused(path).column == "q1"


def test_neither_torque_nor_current_is_refused(save):
    """The message says which columns would do."""
    path, _ = save(columns(tau1=None, tau2=None))
    assert "neither tau1..tau2 nor i1..i2" in str(refused(path))


@pytest.mark.parametrize("n", [1, 3, 6])
def test_joints_of_log_and_robot_agree(save, n):
    """Another number of joints than the robot's is refused with both numbers."""
    path, _ = save(columns())
    error = refused(path, n)
    assert "the log has 2 joints (q1..q2), the robot has" in error.problem
    assert f"{n} joints" in error.allowed


@pytest.mark.parametrize("name", ["t", "q2", "tau1"])
@pytest.mark.parametrize("value", [np.inf, -np.inf])
def test_value_that_is_not_finite_names_column_row_and_count(save, name, value):
    """Infinity in a needed quantity names the column, the first row, and how many there are."""
    data = columns()
    data[name] = spoil(data[name], (1, value), (3, value))
    path, first = save(data)
    error = refused(path)
    assert (error.column, error.row) == (name, first + 1)
    assert f"found {value} (the first of 2)" in error.problem
    assert "finite" in error.allowed
    assert error.remedy


@pytest.mark.parametrize(("name", "what"), [("dq2", "velocity"), ("ddq1", "acceleration")])
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_gaps_in_derivatives_are_noted_and_the_columns_left_out(save, name, what, value):
    """Velocities and accelerations are computed from positions: gaps, as differences have them, refuse nothing."""
    prefix = name[:-1]
    path, first = save(columns(**{f"{prefix}1": [1.0] * 4, f"{prefix}2": [2.0] * 4} | {name: [value, 1.0, 1.0, value]}))
    log = read_log(path)
    assert log.dq is None
    assert log.ddq is None
    (note,) = log.metadata["repairs"]
    assert (note["name"], note["value"]) == (f"{what}_gaps", 2)
    assert f"{name} has no number in 2 rows" in note["text"]
    assert f"row {first}" in note["text"]


@pytest.mark.parametrize(("last", "word"), [(1.0, "repeats"), (0.25, "backward")])
def test_time_that_does_not_increase_names_row_and_values(save, last, word):
    """A repeated or backward time names the row of the later sample and both values."""
    path, first = save(columns(t=[0.0, 0.5, 1.0, last]))
    error = refused(path)
    assert (error.column, error.row) == ("t", first + 3)
    assert word in error.problem
    assert f"{last} after 1.0" in error.problem


@pytest.mark.parametrize("name", ["q1", "tau2"])
def test_text_in_a_needed_column_is_refused(save, name):
    """A needed column of words is refused with its first cell."""
    path, first = save(columns(**{name: ["a", "b", "c", "d"]}))
    error = refused(path)
    assert (error.column, error.row) == (name, first)
    assert "'a'" in error.problem


def test_one_row_is_too_few(save):
    """A log has two rows or more."""
    path, first = save(columns(rows=1))
    error = refused(path)
    assert error.row == first
    assert "2 or more" in error.allowed


@pytest.mark.parametrize(
    ("content", "word"),
    [
        ("t q1 tau1\n0,1,2\n1,2,3\n", "spaces"),
        ("t,q1,q1,tau1\n0,1,1,2\n1,2,2,3\n", "twice"),
        ("t,q1,tau1\n0,1,2\n1,2\n", "2 cells"),
        ("t,q1,tau1\n0,1,2\n1,x,3\n", "'x'"),
        ("0,1,2\n1,2,3\n", "no header"),
        ("", "empty"),
        ("t,q1,tau1\n", "no rows"),
    ],
)
def test_broken_file_is_refused(tmp_path, content, word):
    """Faults of the table itself are input errors of the log."""
    assert word in refused(csv(tmp_path, content)).problem


def test_logs_of_one_robot_are_read_in_order(tmp_path):
    """Several files give logs in their order; one path gives one log."""
    paths = [csv(tmp_path, text(columns()), f"{name}.csv") for name in "ba"]
    assert [log.name for log in read_logs(paths, n=2)] == ["b", "a"]
    assert len(read_logs(str(paths[0]))) == 1


def test_logs_that_do_not_belong_together_are_refused(tmp_path):
    """No log, a log twice (by any path), and logs of different robots are input errors."""
    path = csv(tmp_path, text(columns()), "a.csv")
    other = csv(tmp_path, text(columns(joints=3)), "b.csv")
    (tmp_path / "link.csv").symlink_to(path)
    with pytest.raises(InputError, match="no logs"):
        read_logs([])
    with pytest.raises(InputError, match="twice"):
        read_logs([path, tmp_path / "link.csv"])
    with pytest.raises(InputError, match=r"3 joints, but .*a\.csv has 2"):
        read_logs([path, other])
    with pytest.raises(InputError, match="robot has 6"):
        read_logs([path], n=6)


@pytest.mark.slow
def test_long_log_is_read_by_the_fast_reader(tmp_path):
    """A log of 200,000 rows takes a fraction of a second; a reader that walks lines would take tens."""
    import time

    rng = np.random.default_rng(0)
    log = Log(0.004 * np.arange(200_000), *rng.normal(size=(2, 200_000, 6)))
    for suffix in ("csv", "parquet"):
        write_log(tmp_path / f"log.{suffix}", log)
        start = time.perf_counter()
        read = read_log(tmp_path / f"log.{suffix}")
        assert time.perf_counter() - start < 3.0
        np.testing.assert_array_equal(read.tau, log.tau)

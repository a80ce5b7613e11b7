"""Rows without a number in a needed column."""

import numpy as np
import pytest

from estimation.logs import read_log
from robots.common.errors import InputError
from tests.estimation.logs.made_logs import columns, csv, text


def noted(log):
    return {note["name"]: note for note in log.metadata.get("repairs", ())}


@pytest.mark.parametrize("name", ["t", "q2", "tau1"])
def test_rows_with_an_empty_cell_are_left_out(tmp_path, name):
    """The other rows keep their values; the note says how many of how many, and the line of the first."""
    data = {key: list(values) for key, values in columns(rows=40).items()}
    data[name][5] = data[name][9] = ""
    log = read_log(csv(tmp_path, text(data)), n=2)
    kept = [row for row in range(40) if row not in (5, 9)]
    np.testing.assert_array_equal(log.t, 0.5 * np.array(kept))
    np.testing.assert_array_equal(log.q[:, 0], columns(rows=40)["q1"][kept])
    (note,) = noted(log).values()
    assert note["value"] == 2
    assert "2 of 40 rows" in note["text"]
    assert "row 7" in note["text"]
    assert note["severity"] == "info"


def test_errors_behind_left_out_rows_name_the_line_of_the_file(tmp_path):
    """Rows that were left out do not shift the line of a later fault."""
    data = {key: list(values) for key, values in columns(rows=40).items()}
    data["tau1"][5] = ""
    data["q1"][20] = "inf"
    with pytest.raises(InputError) as caught:
        read_log(csv(tmp_path, text(data)), n=2)
    assert (caught.value.column, caught.value.row) == ("q1", 22)


def test_a_column_without_numbers_is_refused(tmp_path):
    """A joint whose torque is never there cannot be left out row by row."""
    with pytest.raises(InputError, match="no number in any of 4 rows") as caught:
        read_log(csv(tmp_path, text(columns(tau2=[""] * 4))), n=2)
    assert caught.value.column == "tau2"


def test_a_second_publisher_without_torque_is_left_out(tmp_path):
    """Positions that another program repeats between the driver's rows go, and the warning says how many."""
    data = {key: list(values) for key, values in columns(rows=40).items()}
    for row in range(1, 40, 2):
        data["tau1"][row] = data["tau2"][row] = ""
    log = read_log(csv(tmp_path, text(data)), n=2)
    np.testing.assert_array_equal(log.t, np.arange(20.0))
    assert noted(log)["incomplete_rows"]["severity"] == "warning"
    assert "20 of 40 rows" in noted(log)["incomplete_rows"]["text"]


def test_halves_of_the_joints_in_turns_are_put_together(tmp_path):
    """Joints that come in rows of their own are interpolated: a straight line stays one, to rounding."""
    t = 0.01 * np.arange(60)
    first = np.arange(60) % 2 == 0
    data = {"t": t}
    for name, slope, own in (("q1", 1.0, first), ("q2", -2.0, ~first), ("tau1", 3.0, first), ("tau2", 4.0, ~first)):
        data[name] = np.where(own, slope * t, np.nan)
    log = read_log(csv(tmp_path, text(data)), n=2)
    assert len(log) == 29  # the times of the rarer half that the other half surrounds
    for column, slope in ((log.q[:, 0], 1.0), (log.q[:, 1], -2.0), (log.tau[:, 0], 3.0), (log.tau[:, 1], 4.0)):
        np.testing.assert_allclose(column, slope * log.t, atol=1e-12)
    assert "columns_in_turns" in noted(log)


def test_nothing_is_interpolated_over_a_pause(tmp_path):
    """A half that is silent for some time leaves a gap, and no straight line."""
    t = 0.01 * np.arange(200)
    first = np.arange(200) % 2 == 0
    silent = (t > 0.8) & (t < 1.2)
    data = {"t": t}
    for name, own in (("q1", first), ("q2", ~first & ~silent), ("tau1", first), ("tau2", ~first & ~silent)):
        data[name] = np.where(own, np.sin(9.0 * t), np.nan)
    log = read_log(csv(tmp_path, text(data)), n=2)
    assert not ((log.t > 0.81) & (log.t < 1.19)).any()
    np.testing.assert_allclose(log.q[:, 0], np.sin(9.0 * log.t), atol=0.5 * 81.0 * 0.01**2)


@pytest.mark.parametrize("row", [0, 17])
def test_a_stamp_that_was_never_set_is_left_out(tmp_path, row):
    """One time of 0 among times since 1970 costs its row."""
    t = 1.7e9 + 0.01 * np.arange(40)
    t[row] = 0.0
    log = read_log(csv(tmp_path, text(columns(rows=40, t=[repr(float(time)) for time in t]))), n=2)
    assert len(log) == 39
    np.testing.assert_array_equal(log.t, np.delete(t, row))
    assert "rows_without_time" in noted(log)


@pytest.mark.parametrize(
    "t", [[0.0, 3.0, 3.5, 4.0, 8.0], [-2.0, -1.0, 0.0, 1.0, 2.0], [0.0, 1e6, 1e6 + 1, 1e6 + 2, 2e6]]
)
def test_a_time_of_zero_may_be_right(tmp_path, t):
    """The first row at t = 0 stays, also before a pause, and so does a row at 0 behind negative times."""
    log = read_log(csv(tmp_path, text(columns(rows=5, t=t))), n=2)
    np.testing.assert_array_equal(log.t, t)
    assert not noted(log)

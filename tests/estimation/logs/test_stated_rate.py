"""Logs without a column of time, at a stated rate."""

import numpy as np
import pytest

from estimation.logs import read_log, read_logs
from estimation.logs.mappings.mapping import LogMapping, stated_rate
from robots.common.errors import InputError
from tests.estimation.logs.made_logs import columns, csv, refused, text


def noted(log):
    return {note["name"]: note for note in log.metadata.get("repairs", ())}


def test_rows_get_the_times_of_the_rate(tmp_path):
    """At 250 rows per second the rows are 4 ms apart, from 0 on."""
    log = read_log(csv(tmp_path, text(columns(t=None))), n=2, mapping=LogMapping(rate=250.0))
    np.testing.assert_allclose(log.t, [0.0, 0.004, 0.008, 0.012], atol=1e-15)
    np.testing.assert_array_equal(log.q[:, 0], columns()["q1"])
    assert noted(log)["stated_rate"]["severity"] == "info"


def test_a_mapping_states_the_rate(tmp_path):
    """`rate` stands in a mapping beside foreign names."""
    (tmp_path / "map.yaml").write_text("rate: 100\nposition: {columns: [a]}\ntorque: {columns: [b]}\n")
    log = read_log(csv(tmp_path, "a,b\n1,2\n3,4\n5,6\n"), n=1, mapping=tmp_path / "map.yaml")
    np.testing.assert_allclose(log.t, [0.0, 0.01, 0.02], atol=1e-15)
    assert log.tau[:, 0].tolist() == [2.0, 4.0, 6.0]


@pytest.mark.parametrize(("rate", "severity"), [(2.0, "info"), (100.0, "warning")])
def test_a_column_of_time_that_differs_is_noted(tmp_path, rate, severity):
    """The rate counts before the column, as for a counter of rows; a difference is a warning."""
    log = read_log(csv(tmp_path, text(columns())), n=2, mapping=LogMapping(rate=rate))
    np.testing.assert_allclose(log.t, np.arange(4) / rate)
    assert noted(log)["stated_rate"]["severity"] == severity


def test_a_missing_time_is_refused_with_the_option(tmp_path):
    """A table with the names of a log, except for the time, needs the rate and no mapping."""
    error = refused(csv(tmp_path, text(columns(t=None))), 2)
    assert error.column == "t"
    assert "--rate 250" in error.remedy
    assert "mapping" not in error.remedy


def test_a_rate_is_added_to_a_folders_own_mapping(tmp_path):
    """The names of the folder's mapping stay."""
    (tmp_path / "mapping.yaml").write_text("position: {columns: [a]}\ntorque: {columns: [b]}\n")
    csv(tmp_path, "a,b\n1,2\n3,4\n")
    (log,) = read_logs(tmp_path, n=1, mapping=LogMapping(rate=50.0))
    assert log.t.tolist() == [0.0, 0.02]
    assert log.q[:, 0].tolist() == [1.0, 3.0]


def test_rates_that_mean_nothing_are_refused(tmp_path):
    """A rate is positive, and excludes a column of time that the mapping names."""
    for rate in (0.0, -5.0, np.inf, np.nan):
        with pytest.raises(InputError, match="rows per second"):
            stated_rate(rate)
    (tmp_path / "map.yaml").write_text("rate: 100\ntime: {column: s}\n")
    with pytest.raises(InputError, match="exclude each other"):
        read_log(csv(tmp_path, text(columns())), mapping=tmp_path / "map.yaml")
    (tmp_path / "map.yaml").write_text("time: {column: s}\n")
    with pytest.raises(InputError, match="names the column of time 's'"):
        stated_rate(100.0, tmp_path / "map.yaml")

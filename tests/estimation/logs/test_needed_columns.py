"""Only needed columns can refuse a log; others are left out with a note."""

import numpy as np
import pytest

from estimation.logs import read_log
from estimation.logs.needed_columns import is_needed, needed_prefixes
from robots.common.errors import InputError
from tests.estimation.logs.made_logs import columns, csv, text


def noted(log):
    return {note["name"]: note for note in log.metadata.get("repairs", ())}


def test_a_log_needs_time_positions_and_torques_or_currents():
    """Currents are needed only where there are no torques."""
    assert needed_prefixes(["t", "q1", "tau1", "i1", "dq1"]) == {"t", "q", "tau"}
    assert needed_prefixes(["t", "q1", "i1", "dq1"]) == {"t", "q", "i"}
    assert is_needed("tau4", None)
    assert not is_needed("dq1", ["t", "q1", "tau1", "dq1"])


@pytest.mark.parametrize(
    ("more", "field", "name"),
    [
        ({"dq1": [1.0] * 4}, "dq", "velocity_joints"),
        ({"ddq2": [1.0] * 4}, "ddq", "acceleration_joints"),
        ({"i1": [1.0] * 4}, "current", "current_joints"),
        ({"i1": [1.0, np.nan, 1.0, 1.0], "i2": [1.0] * 4}, "current", "current_gaps"),
        ({"i1": [np.nan] * 4, "i2": [np.nan] * 4}, "current", "current_empty"),
        ({"qlink1": [1.0, np.nan, 1.0, 1.0]}, "qlink", "link_position_gaps"),
        ({"qlink1": [1.0, np.inf, 1.0, 1.0]}, "qlink", "link_position_gaps"),
        ({"temp1": [1.0, np.inf, 1.0, 1.0]}, "temperature", "temperature_gaps"),
        ({"temp_env": [1.0, np.inf, 1.0, 1.0]}, "ambient", "ambient_gaps"),
        ({"temp1": ["cold", "cold", "warm", "hot"]}, "temperature", "temperature_text"),
        ({"segment": ["a", "b", "b", "b"]}, "segment", "segment_text"),
        ({"segment": [0.0, 1.0, 1.5, 2.0]}, "segment", "segment_fraction"),
        ({"cycle": [0.0, np.nan, 1.0, 2.0]}, "cycle", "cycle_gaps"),
    ],
)
def test_faults_of_other_quantities_are_noted(tmp_path, more, field, name):
    """The log keeps its motion and torque, and the note names the quantity."""
    log = read_log(csv(tmp_path, text(columns(**more))), n=2)
    assert getattr(log, field) is None
    assert list(noted(log)) == [name]
    np.testing.assert_array_equal(log.q[:, 0], columns()["q1"])
    np.testing.assert_array_equal(log.tau[:, 1], columns()["tau2"])


@pytest.mark.parametrize("extra", ["dq3", "temp3"])
def test_a_column_beyond_the_joints_is_left_out(tmp_path, extra):
    """The quantity keeps the columns of the joints that are there."""
    prefix = extra[:-1]
    more = {f"{prefix}{joint}": np.full(4, float(joint)) for joint in (1, 2, 3)}
    log = read_log(csv(tmp_path, text(columns(**more))), n=2)
    kept = log.dq if prefix == "dq" else log.temperature
    assert kept[0].tolist() == [1.0, 2.0]
    assert extra in next(iter(noted(log).values()))["text"]


def test_a_cell_that_cannot_be_read_spoils_its_quantity_only(tmp_path):
    """A word among the numbers of a velocity leaves all velocities out; of a torque it refuses the log with its row."""
    data = columns(dq1=[1.0, "err", 1.0, 1.0], dq2=[2.0] * 4)
    log = read_log(csv(tmp_path, text(data)), n=2)
    assert log.dq is None
    assert "'err'" in noted(log)["unreadable_column"]["text"]
    assert "row 3" in noted(log)["unreadable_column"]["text"]
    with pytest.raises(InputError, match="'err'") as caught:
        read_log(csv(tmp_path, text(columns(tau1=[1.0, "err", 1.0, 1.0]))), n=2)
    assert (caught.value.column, caught.value.row) == ("tau1", 3)


def test_a_mapping_reads_its_own_columns_only(tmp_path):
    """A column that neither the mapping names nor a log has may hold anything."""
    data = {"s": [0.0, 0.5, 1.0], "a1": [1.0, 2.0, 3.0], "m1": [4.0, 5.0, 6.0], "state": [1, "x", 2]}
    (tmp_path / "map.yaml").write_text("time: {column: s}\nposition: {columns: [a1]}\ntorque: {columns: [m1]}\n")
    log = read_log(csv(tmp_path, text(data)), n=1, mapping=tmp_path / "map.yaml")
    assert log.q[:, 0].tolist() == [1.0, 2.0, 3.0]
    assert log.tau[:, 0].tolist() == [4.0, 5.0, 6.0]
    assert "state" in noted(log)["columns_not_read"]["text"]


def test_columns_that_are_not_read_are_named(tmp_path):
    """The note on a missing torque has the mapping that reads a torque under another name."""
    data = columns(tau1=None, tau2=None, effort_1=[7.0] * 4, effort_2=[8.0] * 4)
    path = csv(tmp_path, text(data))
    log = read_log(path, n=2, torque=False)
    assert "effort_1, effort_2" in noted(log)["columns_not_read"]["text"]
    note = noted(log)["no_torque"]
    assert note["severity"] == "warning"
    (tmp_path / "mapping.yaml").write_text(note["action"].split("mapping.yaml:\n", 1)[1])
    assert read_log(path, n=2, mapping=tmp_path / "mapping.yaml").tau[0].tolist() == [7.0, 8.0]

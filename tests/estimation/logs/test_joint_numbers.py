"""How the joints of a file are counted."""

import numpy as np
import pytest

from estimation.logs import read_log
from estimation.logs.joint_numbers import renamed_joints
from estimation.logs.mappings.mapping import LogMapping, PerJoint
from estimation.logs.parquet_streams import open_stream
from robots.common.errors import InputError
from robots.common.tables.table_files import write_table
from tests.estimation.logs.made_logs import columns, csv, refused, text


@pytest.mark.parametrize(
    ("names", "new"),
    [
        (["t", "q1", "q2", "tau1", "tau2"], {}),
        (["t", "q0", "q1", "tau0", "tau1"], {"q0": "q1", "q1": "q2", "tau0": "tau1", "tau1": "tau2"}),
        (["q0", "q1", "tau1", "tau2"], {"q0": "q1", "q1": "q2"}),
        (["q1", "q2", "tau0", "tau1"], {"tau0": "tau1", "tau1": "tau2"}),
        (["q0", "q1", "q2", "temp1"], {"q0": "q1", "q1": "q2", "q2": "q3", "temp1": "temp2"}),
        (["q01", "q02", "tau01", "tau02"], {"q01": "q1", "q02": "q2", "tau01": "tau1", "tau02": "tau2"}),
        (["q00", "q01", "tau1", "tau2"], {"q00": "q1", "q01": "q2"}),
        (["q1", "q01"], {}),
    ],
)
def test_columns_get_the_names_of_a_log(names, new):
    """Each quantity with a column 0 is counted from 0, and the others as the positions, if that leaves no joint out."""
    assert renamed_joints(names) == new


@pytest.mark.parametrize("mapping", [None, "position: {sign: [1, 1, 1]}\n", "torque: {columns: 'tau{index}'}\n"])
def test_joints_counted_from_zero_are_read_with_a_note(tmp_path, mapping):
    """Columns q0 to q2 are joints 1 to 3, with and without a mapping that describes some of them."""
    made = columns(joints=3, dq1=[1.0] * 4, dq2=[2.0] * 4, dq3=[3.0] * 4)
    data = {name if name == "t" else f"{name[:-1]}{int(name[-1]) - 1}": values for name, values in made.items()}
    path = csv(tmp_path, text(data))
    if mapping is not None:
        (tmp_path / "map.yaml").write_text(mapping)
    log = read_log(path, n=3, mapping=None if mapping is None else tmp_path / "map.yaml")
    for joint in range(3):
        np.testing.assert_array_equal(log.q[:, joint], made[f"q{joint + 1}"])
        np.testing.assert_array_equal(log.tau[:, joint], made[f"tau{joint + 1}"])
    assert log.dq[0].tolist() == [1.0, 2.0, 3.0]
    notes = {note["name"]: note["text"] for note in log.metadata["repairs"]}
    assert "q0 to q2 as q1 to q3" in notes["joint_numbers"]


def test_units_follow_their_columns(tmp_path):
    """The unit that the head states for q0 is that of joint 1."""
    head = "# %ECSV 1.0\n# ---\n# delimiter: ','\n# datatype:\n# - {name: q0, unit: deg, datatype: float64}\n"
    log = read_log(csv(tmp_path, head + "t,q0,q1,tau0,tau1\n0,180,1,1,1\n1,90,2,2,2\n"), n=2)
    np.testing.assert_allclose(log.q, [[np.pi, 1.0], [np.pi / 2, 2.0]])


def test_errors_name_the_columns_of_the_file(tmp_path):
    """A fault in q1 of a file that counts from 0 is one of q1, and of joint 2."""
    error = refused(csv(tmp_path, "t,q0,q1,tau0,tau1\n0,1,1,1,1\n1,1,inf,1,1\n2,2,2,2,2\n"))
    assert (error.column, error.row, error.joint) == ("q1", 3, 2)
    assert "column q1" in str(error)


def test_a_number_too_many_is_refused(tmp_path):
    """q0 to q2 of a robot of two joints are three joints; q1 beside q01 is no count at all."""
    with pytest.raises(InputError, match="the log has 3 joints"):
        read_log(csv(tmp_path, text(columns(q0=[0.0] * 4, tau0=[0.0] * 4))), n=2)
    assert refused(csv(tmp_path, text(columns(q01=[0.0] * 4)))).column == "q01"
    assert refused(csv(tmp_path, text(columns(q1000000000000=[0.0] * 4)))).column == "q3"


def test_a_log_in_pieces_is_counted_alike(tmp_path):
    """A Parquet file that is read in pieces is asked the same question, also if a mapping names its torques."""
    made = columns(rows=40, joints=2)
    data = {name if name == "t" else f"{name[:-1]}{int(name[-1]) - 1}": values for name, values in made.items()}
    write_table(tmp_path / "log.parquet", data)
    for mapping in (None, LogMapping(torque=PerJoint(columns=["tau{index}"]))):
        log = open_stream(tmp_path / "log.parquet", 2, mapping=mapping).rows(0, 40)
        np.testing.assert_array_equal(log.q[:, 1], made["q2"])
        np.testing.assert_array_equal(log.tau[:, 0], made["tau1"])
    with pytest.raises(InputError, match="read in pieces") as caught:
        open_stream(tmp_path / "log.parquet", 2, mapping=LogMapping(rate=100.0))
    assert "--no-stream" in caught.value.remedy

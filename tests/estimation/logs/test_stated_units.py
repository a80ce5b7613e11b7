"""What a log's file says of itself: units, robot and period."""

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from estimation.logs import read_log
from tests.estimation.logs.made_logs import csv, refused


@pytest.mark.parametrize(
    "block", ["# units: deg\n", "#units=deg\n", "# units: {q: deg, dq: deg/s, ddq: deg/s^2, qlink: deg}\n"]
)
def test_degrees_become_radians(tmp_path, block):
    """With units in degrees all angles and their rates are converted, torque is not, and the statement is used up."""
    names = [f"{prefix}{joint}" for prefix in ("q", "dq", "ddq", "qlink", "tau") for joint in (1, 2)]
    rows = "\n".join(",".join([str(t), *["90", "-180"] * 5]) for t in range(3))
    log = read_log(csv(tmp_path, f"{block}t,{','.join(names)}\n{rows}\n"))
    for signal in (log.q, log.dq, log.ddq, log.qlink):
        np.testing.assert_allclose(signal, [[np.pi / 2, -np.pi]] * 3, rtol=1e-15)  # one rounding of the product
    assert log.tau[0].tolist() == [90.0, -180.0]
    assert "units" not in log.metadata


def test_units_by_column_are_honoured(tmp_path):
    """Units of an ECSV block apply column by column: milliseconds, degrees, metres and milliamperes."""
    units = {"t": "ms", "q1": "deg", "q2": "m", "i1": "mA", "i2": "A"}
    entries = "".join(f"# - {{name: {name}, unit: {unit}, datatype: float64}}\n" for name, unit in units.items())
    head = "# %ECSV 1.0\n# ---\n# delimiter: ','\n# datatype:\n" + entries
    log = read_log(csv(tmp_path, head + "t,q1,q2,i1,i2\n0,180,2,500,3\n4,180,2,500,3\n"))
    np.testing.assert_allclose(log.t, [0.0, 0.004], rtol=1e-15)
    np.testing.assert_allclose(log.q[0], [np.pi, 2.0], rtol=1e-15)
    np.testing.assert_allclose(log.current[0], [0.5, 3.0], rtol=1e-15)


@pytest.mark.parametrize("unit", ["N m", "N*m", "N.m", "Nm"])
def test_spellings_of_a_unit_are_one(tmp_path, unit):
    """Spaces and signs of product do not matter in a unit."""
    block = f"# units: {{tau: '{unit}', ddq: rad / s2}}\n"
    assert read_log(csv(tmp_path, block + "t,q1,tau1\n0,1,2\n1,2,3\n")).has_torque


@pytest.mark.parametrize(
    ("block", "word"),
    [
        ("# units: grad\n", "'grad'"),
        ("# units: [rad]\n", "['rad']"),
        ("# units: {tau: lbf}\n", "lbf"),
        ("# units: {position: deg}\n", "position"),
        ("# unit: deg\n", "'unit'"),
        ("# Units: deg\n", "'Units'"),
        ("# robot: 3\n", "`robot`"),
        ("# period: fast\n", "`period`"),
        ("# period: 0\n", "`period`"),
        ("# period: -0.004\n", "`period`"),
        ("# period: .nan\n", "`period`"),
        ("# period: true\n", "`period`"),
        ("# period: [1]\n", "`period`"),
        ("# %ECSV 1.0\n# delimiter: ','\n# datatype: [{name: q1, unit: turns}]\n", "turns"),
        ("# %ECSV 1.0\n# delimiter: ','\n# datatype: [{name: q1, unit: rad}]\n# meta: {units: deg}\n", "states 'deg'"),
    ],
)
def test_statement_that_is_not_understood_is_refused(tmp_path, block, word):
    """An unknown unit, a misspelt key, a robot that is no name and a period that is no time are never ignored."""
    assert word in str(refused(csv(tmp_path, block + "t,q1,tau1\n0,1,2\n1,2,3\n")))


def test_robot_and_period_are_kept(tmp_path):
    """What the block says of the recording is metadata of the log."""
    path = csv(tmp_path, "# robot: er3a\n# period: '0.004'\n# operator: Ann\nt,q1,tau1,x\n0,1,2,3\n1,2,3,4\n")
    metadata = read_log(path).metadata
    assert [note["text"] for note in metadata.pop("repairs")] == ["not read: x"]
    assert metadata == {
        "robot": "er3a",
        "period": 0.004,
        "operator": "Ann",
        "file": str(path),
        "ignored_columns": ["x"],
    }


def test_parquet_file_of_others_states_units_in_its_key_value_pairs(tmp_path):
    """A units entry of any Parquet writer counts."""
    path = tmp_path / "log.parquet"
    pq.write_table(
        pa.table({"t": [0, 1], "q1": [180, 90], "tau1": [1, 2]}).replace_schema_metadata({"units": "deg"}), path
    )
    np.testing.assert_allclose(read_log(path).q[:, 0], [np.pi, np.pi / 2], rtol=1e-15)

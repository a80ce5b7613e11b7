"""Mapping files: names, units, signs, gears and order of foreign columns."""

import numpy as np
import pytest

from estimation.logs import read_log, read_logs
from robots.common.errors import InputError


def files(tmp_path, table, mapping):
    (tmp_path / "log.csv").write_text(table)
    (tmp_path / "map.yaml").write_text(mapping)
    return tmp_path / "log.csv", tmp_path / "map.yaml"


ROWS = "time;A1 pos;A2 pos;A1 cur;A2 cur\n0;90,0;10;50;-10\n4;45,0;20;100;10\n"
POSITIONS = "time: {column: time, unit: ms}\nposition: {columns: [A1 pos, A2 pos], unit: deg}\n"


def test_names_units_and_percent(tmp_path):
    """Milliseconds, degrees and percent of the rated torque become seconds, radians and newton metres."""
    path, mapping = files(
        tmp_path, ROWS, POSITIONS + 'torque: {columns: [A1 cur, A2 cur], unit: "%", rated: [200, 30], sign: [1, -1]}\n'
    )
    log = read_log(path, 2, mapping=mapping)
    np.testing.assert_allclose(log.t, [0.0, 0.004])
    np.testing.assert_allclose(log.q, np.deg2rad([[90, 10], [45, 20]]))
    np.testing.assert_allclose(log.tau, [[100, 3], [200, -3]])


def test_motor_side_and_torque_constants(tmp_path):
    """Motor positions are divided by the gear ratio; currents become torques by constant and gear."""
    path, mapping = files(
        tmp_path,
        ROWS,
        "time: {column: time, unit: ms}\n"
        "position: {columns: [A1 pos, A2 pos], unit: deg, side: motor}\n"
        "current: {columns: [A1 cur, A2 cur], unit: mA, side: motor}\n"
        "gear_ratio: [100, -50]\ntorque_constant: [0.2, 0.1]\n",
    )
    log = read_log(path, mapping=mapping)
    np.testing.assert_allclose(log.q, np.deg2rad([[0.9, -0.2], [0.45, -0.4]]))
    np.testing.assert_allclose(log.current, [[0.05, -0.01], [0.1, 0.01]])
    np.testing.assert_allclose(log.tau, [[0.05 * 20, 0.01 * 5], [0.1 * 20, -0.01 * 5]])


def test_a_sign_alone_keeps_the_usual_columns(tmp_path):
    """The check of a log advises a sign, a scale or a unit for one joint: no columns need be named for it."""
    path, mapping = files(
        tmp_path, "t,q1,q2,tau1,tau2\n0,1,2,3,4\n1,2,3,4,5\n", "position: {sign: [1, -1]}\ntorque: {unit: N mm}\n"
    )
    log = read_log(path, 2, mapping=mapping)
    np.testing.assert_allclose(log.q, [[1, -2], [2, -3]])
    np.testing.assert_allclose(log.tau, [[0.003, 0.004], [0.004, 0.005]])


COUPLED = "t,q1,q2,q3,tau1,tau2,tau3\n0,1,2,5,7,8,9\n1,2,3,7,8,9,10\n"


def test_coupled_axes_become_joints(tmp_path):
    """Axis 3 counts q3 + q2. With torques of the axes, the torque of joint 2 has that of axis 3, too."""
    path, mapping = files(tmp_path, COUPLED, "coupling: {3: {2: 1}}\n")
    log = read_log(path, mapping=mapping)
    np.testing.assert_allclose(log.q, [[1, 2, 3], [2, 3, 4]])
    np.testing.assert_allclose(log.tau, [[7, 8, 9], [8, 9, 10]])
    path, mapping = files(tmp_path, COUPLED, "coupling: {3: {2: -1}}\ncoupled_torques: true\n")
    log = read_log(path, mapping=mapping)
    np.testing.assert_allclose(log.q, [[1, 2, 7], [2, 3, 10]])
    np.testing.assert_allclose(log.tau, [[7, -1, 9], [8, -1, 10]])


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("coupling: {4: {2: 1}}", "axis 4 with joint 2; allowed: two different numbers from 1 to 3"),
        ("coupling: {2: {2: 1}}", "axis 2 with joint 2"),
        ("coupling: {3: {2: 1}, 2: {3: 1}}", "does not determine the joints"),
    ],
)
def test_couplings_that_mean_nothing_are_refused(tmp_path, text, said):
    """A joint that is not there, an axis with itself, and readings without a solution."""
    path, mapping = files(tmp_path, COUPLED, text + "\n")
    with pytest.raises(InputError, match=said):
        read_log(path, 3, mapping=mapping)


def test_order_scale_and_offset(tmp_path):
    """The list of columns is the robot's order; scales and offsets are one for all or one a joint."""
    path, mapping = files(
        tmp_path,
        "t,x,y,tau1,tau2\n0,1,2,3,4\n1,2,3,4,5\n",
        "position: {columns: [y, x], scale: 2, offset: [0.5, -0.5]}\n",
    )
    log = read_log(path, mapping=mapping)
    np.testing.assert_allclose(log.q, [[4.5, 1.5], [6.5, 3.5]])
    np.testing.assert_allclose(log.tau, [[3, 4], [4, 5]])


@pytest.mark.parametrize(
    ("pattern", "joints"), [("pos_{joint}", "joints: [b, a]\n"), ("p{index}", ""), ("m{joint}", ""), ("m", "")]
)
def test_patterns_name_a_column_for_each_joint(tmp_path, pattern, joints):
    """A pattern stands for all joints: by name, by number from 1, by index from 0, or by a number at its end."""
    path, mapping = files(
        tmp_path,
        "t,pos_a,pos_b,p0,p1,m1,m2,tau1,tau2\n0,2,1,1,2,1,2,0,0\n1,2,1,1,2,1,2,0,0\n",
        f"position: {{columns: '{pattern}'}}\n{joints}",
    )
    log = read_log(path, mapping=mapping)
    np.testing.assert_array_equal(log.q, [[1, 2], [1, 2]])


@pytest.mark.parametrize(
    ("mapping", "word"),
    [
        ("postion: {columns: x}\n", "did you mean 'position'"),
        ("position: {column: x}\n", "did you mean 'columns'"),
        ("position: {columns: [y, z], unit: deg}\n", "a column that the file does not have"),
        ("position: {columns: [x, y], unit: gon}\n", "unit 'gon'"),
        ("position: {columns: [x, y], sign: 2}\n", "a sign is 1 or -1"),
        ("position: {columns: [x, y], scale: [1, 2, 3]}\n", "3 values"),
        ("position: {columns: [x, y], scale: 0}\n", "not zero"),
        ("position: {columns: [x, y], side: motor}\n", "no gear ratios"),
        ("position: {columns: [x, y], unit: '%'}\n", "lacks `rated`"),
        ("position: {columns: [x, note]}\n", "'start'"),
        ("torque_constant: [1]\nposition: {columns: [x, y]}\n", "1 torque constants"),
        ("time: {column: t, unit: week}\nposition: {columns: [x, y]}\n", "unit 'week'"),
        ("", "empty"),
    ],
)
def test_mistakes_are_named(tmp_path, mapping, word):
    """A misspelt key, a missing column, an unknown unit or a list of another length is an input error."""
    path, mapping = files(tmp_path, "t,x,y,note,tau1,tau2\n0,1,2,start,3,4\n1,2,3,end,4,5\n", mapping)
    with pytest.raises(InputError, match=r".") as caught:
        read_log(path, 2, mapping=mapping)
    assert word in str(caught.value)


def test_folder_brings_its_mapping(tmp_path):
    """A mapping.yaml beside the logs of a folder is theirs."""
    (tmp_path / "a.csv").write_text("t,x,tau1\n0,90,2\n1,180,3\n")
    (tmp_path / "mapping.yaml").write_text("position: {columns: x, unit: deg}\n")
    (log,) = read_logs(tmp_path, 1)
    np.testing.assert_allclose(log.q[:, 0], [np.pi / 2, np.pi])


def test_link_encoders_of_some_joints(tmp_path):
    """A pattern may find columns for some joints only; one that finds none is refused."""
    table = "t,a1,a2,m1,m2,s2\n0,1,2,3,4,2.1\n0.004,1.1,2.2,3,4,2.3\n"
    text = 'time: {column: t}\nposition: {columns: ["a{joint}"]}\ntorque: {columns: ["m{joint}"]}\n'
    path, mapping = files(tmp_path, table, text + 'link_position: {columns: ["s{joint}"]}\n')
    log = read_log(path, 2, mapping=mapping)
    assert np.isnan(log.qlink[:, 0]).all()
    assert log.qlink[:, 1].tolist() == [2.1, 2.3]
    path, mapping = files(tmp_path, table, text + 'link_position: {columns: ["z{joint}"]}\n')
    with pytest.raises(InputError) as caught:
        read_log(path, 2, mapping=mapping)
    assert caught.value.column == "z1"

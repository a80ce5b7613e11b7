"""Logs of robots with linear axes: units per joint, and units of angles that leave linear axes alone."""

import numpy as np
import pytest

from estimation.logs import read_log, read_logs, write_log
from robots.common.errors import InputError
from robots.common.tables.table_files import read_table
from robots.signals import Log

KINDS = ("revolute", "prismatic")
ROWS = "t,q1,q2,tau1,tau2\n0,90,0.5,1,2\n0.1,45,0.25,3,4\n"
ANGLES = np.deg2rad([90, 45])


def log_of(tmp_path, mapping, rows=ROWS, kinds=KINDS):
    """Reads a log by a mapping."""
    (tmp_path / "log.csv").write_text(rows)
    (tmp_path / "map.yaml").write_text(mapping)
    return read_log(tmp_path / "log.csv", mapping=tmp_path / "map.yaml", kinds=kinds)


def notes(log):
    """The reader's notes."""
    return [(note["text"], note["action"]) for note in log.metadata.get("repairs", ())]


def test_one_unit_of_angles_leaves_linear_axes_in_metres(tmp_path):
    """Degrees for all joints are degrees of the angles; the linear axis is read in metres, which a note says."""
    log = log_of(tmp_path, 'position: {columns: "q{joint}", unit: deg}\n')
    np.testing.assert_allclose(log.q, np.column_stack([ANGLES, [0.5, 0.25]]), rtol=1e-15)
    ((text, action),) = notes(log)
    assert text == "the unit deg of q does not suit linear joint 2"
    assert action.startswith("read in m there")


@pytest.mark.parametrize(
    ("entry", "q", "tau"),
    [
        ("unit: [deg, m]", [0.5, 0.25], [2, 4]),
        ("unit: [deg, mm]", [0.5e-3, 0.25e-3], [2, 4]),
        ("unit: [deg, mm], scale: [1, -10]", [-5e-3, -2.5e-3], [2, 4]),
    ],
)
def test_one_unit_per_joint(entry, q, tau, tmp_path):
    """A list of units has one per joint, in the robot's order, and nothing needs a note."""
    log = log_of(tmp_path, f'position: {{columns: "q{{joint}}", {entry}}}\n')
    np.testing.assert_allclose(log.q, np.column_stack([ANGLES, q]), rtol=1e-14)
    np.testing.assert_array_equal(log.tau[:, 1], tau)
    assert notes(log) == []


def test_forces_and_torques(tmp_path):
    """Torque units of all joints leave forces in newtons; a list may mix them."""
    mapping = 'position: {columns: "q{joint}", unit: [deg, m]}\ntorque: {columns: "tau{joint}", unit: %s}\n'
    np.testing.assert_allclose(log_of(tmp_path, mapping % "mNm").tau, [[1e-3, 2], [3e-3, 4]])
    np.testing.assert_allclose(log_of(tmp_path, mapping % "[N m, kN]").tau, [[1, 2e3], [3, 4e3]])


def test_rates_follow_the_same_rule(tmp_path):
    """Velocities in deg/s and accelerations in deg/s2 leave linear axes in m/s and m/s2."""
    rows = "t,q1,q2,v1,v2,a1,a2,tau1,tau2\n0,0,0,180,1,90,2,0,0\n1,0,0,180,1,90,2,0,0\n"
    mapping = 'velocity: {columns: "v{joint}", unit: deg/s}\nacceleration: {columns: "a{joint}", unit: deg/s2}\n'
    log = log_of(tmp_path, mapping, rows)
    np.testing.assert_allclose(log.dq, [[np.pi, 1], [np.pi, 1]])
    np.testing.assert_allclose(log.ddq, [[np.pi / 2, 2], [np.pi / 2, 2]])
    assert len(notes(log)) == 2


def test_motor_angles_of_a_linear_axis(tmp_path):
    """A motor turns whatever it drives: degrees at the motor apply to a linear axis, with its gear in rad/m."""
    mapping = 'position: {columns: "q{joint}", unit: deg, side: motor}\ngear_ratio: [100, 500]\n'
    rows = ROWS.replace("0.5", "18000").replace("0.25", "9000")
    np.testing.assert_allclose(log_of(tmp_path, mapping, rows).q[:, 1], np.array([100, 50]) * np.pi / 500)


WRONG = {
    "degrees of a linear axis": ("unit: [deg, deg]", r"unit 'deg' of a linear axis; allowed: rad, m, mm"),
    "millimetres of an angle": ("unit: [mm, mm]", r"unit 'mm' of a revolute joint; allowed: rad, deg, mrad, turn"),
    "three units": ("unit: [deg, m, m]", r"unit of q has 3 values; allowed: 1 or 2"),
    "unknown for all": ("unit: gon", r"unit 'gon'"),
    "unknown for one": ("unit: [deg, gon]", r"unit 'gon'"),
    "no text": ("unit: [deg, [m]]", r"position\.unit"),
}


@pytest.mark.parametrize("case", WRONG)
def test_units_that_do_not_fit_are_refused(case, tmp_path):
    """A unit of one joint that does not suit it is refused with what would."""
    entry, message = WRONG[case]
    with pytest.raises(InputError, match=message):
        log_of(tmp_path, f'position: {{columns: "q{{joint}}", {entry}}}\n')


@pytest.mark.parametrize("joints", ["[0, 1]", '["0", "1"]', "[0, '1']"])
def test_joints_may_have_numbers_for_names(joints, tmp_path):
    """Joint names that are numbers need no quotes: a file that counts from 0 is read."""
    rows = ROWS.replace("q1", "p0").replace("q2", "p1").replace("tau1", "u0").replace("tau2", "u1")
    mapping = f'joints: {joints}\nposition: {{columns: "p{{joint}}"}}\ntorque: {{columns: "u{{joint}}"}}\n'
    log = log_of(tmp_path, mapping, rows)
    np.testing.assert_array_equal(log.q, [[90, 0.5], [45, 0.25]])
    np.testing.assert_array_equal(log.tau, [[1, 2], [3, 4]])


def test_names_that_are_neither_text_nor_numbers_are_refused(tmp_path):
    """A truth value is no name of a joint."""
    with pytest.raises(InputError, match="joints"):
        log_of(tmp_path, "joints: [true, false]\n")


HEAD = "# units: deg\n"


def test_the_units_of_a_head_leave_linear_axes_alone(tmp_path):
    """``units: deg`` in the head of a file, for all angles or for q, is not one of linear axes."""
    for head in ("# units: deg\n", "# units: {q: deg}\n"):
        (tmp_path / "log.csv").write_text(head + ROWS)
        (log,) = read_logs(tmp_path / "log.csv", kinds=KINDS)
        np.testing.assert_allclose(log.q, np.column_stack([ANGLES, [0.5, 0.25]]), rtol=1e-15)
        assert notes(log)[0][0] == "the unit deg of q does not suit linear joint 2"


def test_a_written_log_states_metres_and_newtons(tmp_path):
    """A log of a robot with a linear axis states its units, and reads back the same whoever reads it."""
    t = np.arange(4.0)
    q = np.arange(8.0).reshape(4, 2)
    log = Log(t=t, q=q, dq=q, ddq=q, tau=q, qlink=q, current=q)
    for name in ("log.csv", "log.parquet"):
        write_log(tmp_path / name, log, kinds=KINDS)
        units = read_table(tmp_path / name).units
        assert [units[f"{p}2"] for p in ("q", "dq", "ddq", "tau", "qlink", "i")] == ["m", "m/s", "m/s^2", "N", "m", "A"]
        assert (units["q1"], units["tau1"]) == ("rad", "N m")
        for kinds in (None, KINDS):
            back = read_log(tmp_path / name, kinds=kinds)
            np.testing.assert_array_equal(back.q, q)
            np.testing.assert_array_equal(back.tau, q)
    with pytest.raises(InputError, match="3 joint kinds; allowed: 2"):
        write_log(tmp_path / "other.csv", log, kinds=("revolute",) * 3)


def test_logs_of_earlier_versions_are_read(tmp_path):
    """Logs that call a linear axis rad and N m hold metres and newtons, and are read as such."""
    log = Log(t=np.arange(4.0), q=np.arange(8.0).reshape(4, 2), tau=np.ones((4, 2)))
    write_log(tmp_path / "old.csv", log)
    np.testing.assert_array_equal(read_log(tmp_path / "old.csv", kinds=KINDS).q, log.q)

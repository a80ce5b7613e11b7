"""Recordings of known programs are read without a mapping: one contract for all of them."""

import numpy as np
import pytest

from estimation.logs import LogMapping, read_log
from estimation.logs.mappings.mapping import PerJoint
from estimation.logs.recorders import RECORDERS, recorder_of
from robots.common.errors import InputError
from tests.estimation.logs.recordings import FORMATS, UR_NAMES, T, franka_printed, motion, table, ur_rtde

EACH = pytest.mark.parametrize("name", FORMATS)


def written(tmp_path, name, **changes):
    form = FORMATS[name]
    q, dq, tau = motion(form.joints)
    return form, form.write(tmp_path / "log.csv", T, q, dq, tau), (q, dq, tau)


def refused(path, n=None, **options):
    with pytest.raises(InputError) as caught:
        read_log(path, n, **options)
    assert caught.value.file == str(path)
    return caught.value


def cells(path):
    lines = path.read_text().splitlines()
    delimiter = "," if "," in lines[-1] else " "
    return [line.removeprefix("# ").split(delimiter) for line in lines], delimiter


def spoilt(path, column, *, row=None, to=None):
    """Renames a column, or changes one cell."""
    rows, delimiter = cells(path)
    place = [name.strip() for name in rows[0]].index(column)
    rows[row or 0][place] = to
    path.write_text("\n".join(delimiter.join(row) for row in rows) + "\n")


@EACH
def test_recording_is_read_without_a_mapping(tmp_path, name):
    """Time in seconds, positions, velocities and torques are those that were recorded, in the robot's order."""
    form, path, (q, dq, tau) = written(tmp_path, name)
    log = read_log(path, form.joints, joints=UR_NAMES if name == "rostopic" else None)
    np.testing.assert_allclose(log.t, T + form.stamp, atol=1e-9)  # integers of ns, or milliseconds
    np.testing.assert_allclose(log.q, q, rtol=1e-15)
    np.testing.assert_allclose(log.tau, tau, rtol=1e-15)
    if log.dq is not None:
        np.testing.assert_allclose(log.dq, dq, rtol=1e-15)


@EACH
def test_source_of_the_torque_is_stated(tmp_path, name):
    """Metadata and a note of the check say which columns became the torque, and what they mean."""
    form, path, _ = written(tmp_path, name)
    log = read_log(path, form.joints, joints=UR_NAMES if name == "rostopic" else None)
    source = log.metadata.get("torque_source")
    if form.source is None:
        assert source is None
        return
    assert source["columns"].startswith(form.source)
    note = next(note for note in log.metadata["repairs"] if note["name"] == "torque_source")
    assert (note["name"], note["value"]) == ("torque_source", len(T))
    assert source["columns"] in note["text"]
    assert source["meaning"] in note["text"]


@EACH
@pytest.mark.parametrize("which", ["position", "torque"])
def test_missing_column_is_named(tmp_path, name, which):
    """A recording that lacks one joint names its column."""
    form, path, _ = written(tmp_path, name)
    column = getattr(form, which)
    spoilt(path, column, to="other")
    error = refused(path)
    assert (error.column, error.row) == (column, 1)
    assert "missing" in error.problem


@EACH
@pytest.mark.parametrize("which", ["position", "torque"])
def test_bad_cell_is_named(tmp_path, name, which):
    """A cell that is no number is named with its column and line."""
    form, path, _ = written(tmp_path, name)
    spoilt(path, getattr(form, which), row=7, to="x")
    error = refused(path)
    assert (error.column, error.row) == (getattr(form, which), 8)
    assert "'x'" in error.problem


@EACH
def test_row_that_was_cut_is_named(tmp_path, name):
    """The last row of a program that was stopped may be half a row."""
    _, path, _ = written(tmp_path, name)
    rows, delimiter = cells(path)
    path.write_text("\n".join(delimiter.join(row) for row in [*rows[:-1], rows[-1][:4]]) + "\n")
    error = refused(path)
    assert error.row == len(rows)
    assert "4 cells" in error.problem


@EACH
def test_another_number_of_joints_is_refused(tmp_path, name):
    """A robot with other joints than the recording is refused with both numbers."""
    form, path, _ = written(tmp_path, name)
    assert f"{form.joints} joints" in refused(path, 2).problem


def test_measured_currents_come_before_commanded_torques(tmp_path):
    """Of UR's columns, a measured current is taken before a torque that the controller computes."""
    q, dq, tau = motion(6)
    path = ur_rtde(tmp_path / "a.csv", T, q, dq, tau, torque=("target_moment", "actual_current", "target_current"))
    log = read_log(path, 6)
    assert log.tau is None
    np.testing.assert_allclose(log.current, tau / 10.0, rtol=1e-15)
    source = log.metadata["torque_source"]
    assert (source["quantity"], source["measured"]) == ("current", True)
    assert "target_moment" in source["instead"]


def test_commanded_torques_are_called_that(tmp_path):
    """Torques that the controller computes from its model are not said to be measured."""
    q, dq, tau = motion(6)
    source = read_log(ur_rtde(tmp_path / "a.csv", T, q, dq, tau, torque=("target_moment",))).metadata["torque_source"]
    assert source["measured"] is False


def test_mapping_completes_a_recording(tmp_path):
    """Torque constants alone are a mapping, and so is another column for the torque."""
    q, dq, tau = motion(6)
    path = ur_rtde(tmp_path / "a.csv", T, q, dq, tau, torque=("target_moment", "actual_current"))
    log = read_log(path, 6, mapping=LogMapping(torque_constant=[10.0] * 6))
    np.testing.assert_allclose(log.tau, tau, rtol=1e-14)
    other = read_log(path, 6, mapping=LogMapping(torque=PerJoint(columns=["target_moment_{index}"])))
    np.testing.assert_allclose(other.tau, tau, rtol=1e-15)
    assert other.current is None
    assert "torque_source" not in other.metadata


def test_recording_without_torque_says_what_to_record(tmp_path):
    """UR's recorder writes the chosen columns; without currents the message names them."""
    q, dq, tau = motion(6)
    path = ur_rtde(tmp_path / "a.csv", T, q, dq, tau, torque=())
    error = refused(path)
    assert "actual_current" in error.remedy
    assert read_log(path, torque=False).tau is None


def test_temperatures_of_ur_are_read(tmp_path):
    """Joint temperatures are those of the log."""
    q, dq, tau = motion(6)
    log = read_log(ur_rtde(tmp_path / "a.csv", T, q, dq, tau, temperature=True))
    assert (log.temperature == 31.5).all()


@pytest.mark.parametrize("suffix", ["log", "txt", "jsonl"])
def test_printed_robot_states_are_read(tmp_path, suffix):
    """What libfranka prints is a log, whatever the file is called."""
    q, dq, tau = motion(7)
    path = franka_printed(tmp_path / f"states.{suffix}", T, q, dq, tau)
    log = read_log(path, 7)
    np.testing.assert_allclose(log.t, T, atol=1e-12)
    for found, expected in ((log.q, q), (log.dq, dq), (log.tau, tau)):
        np.testing.assert_array_equal(found, expected)


def test_printed_robot_state_that_was_cut_is_named(tmp_path):
    """A line that ends too early, or lacks a field, is named."""
    path = franka_printed(tmp_path / "states.log", T, *motion(7))
    lines = path.read_text().splitlines()
    path.write_text("\n".join([*lines[:9], lines[9][:-30]]))
    assert refused(path).row == 10
    path.write_text("\n".join([*lines[:9], lines[9].replace('"tau_J"', '"tau"')]))
    error = refused(path)
    assert (error.column, error.row) == ("tau_J[0]", 10)


def test_messages_of_several_sources_are_named(tmp_path):
    """A topic whose rows have other joints than the first is refused with the row."""
    path = FORMATS["rostopic"].write(tmp_path / "log.csv", T, *motion(6))
    spoilt(path, "field.name2", row=5, to="gripper")
    error = refused(path)
    assert (error.column, error.row) == ("field.name2", 6)


def test_a_log_with_its_own_names_is_nobodys_recording():
    """Names of a log come first, whatever else is in the file."""
    for form in ("actual_q_0", "tau_J[0]", "mp1"):
        assert recorder_of(["t", "q1", "tau1", form, "q[0]", "mt1", "ip1", "timestamp"]) is None
    assert len({recorder.name for recorder in RECORDERS}) == len(RECORDERS)


def test_derivative_of_the_torque_is_no_torque(tmp_path):
    """dtau_J in front of tau_J does not mislead."""
    q, dq, tau = motion(7)
    columns = {"time": T}
    for name, values in (("dtau_J", 0 * tau), ("tau_J", tau), ("dq", dq), ("q", q)):
        columns |= {f"{name}[{joint}]": values[:, joint] for joint in range(7)}
    np.testing.assert_array_equal(read_log(table(tmp_path / "log.csv", columns), 7).tau, tau)


TOKENS = (
    b",",
    b";",
    b" ",
    b"\n",
    b'"',
    b"#",
    b"nan",
    b"\0",
    b"\xff",
    b"1e999",
    b"-",
    b"{",
    b"\t",
    b"",
    b"x",
    b"\r",
    b"%",
)


@pytest.mark.slow
def test_mangled_recordings_end_in_a_message(tmp_path):
    """Whatever happens to a file, it is a log or an input error that names the file."""
    rng = np.random.default_rng(7)
    sources = {}
    for name, form in FORMATS.items():
        sources[name] = form.write(tmp_path / "whole.csv", T[:8], *(x[:8] for x in motion(form.joints))).read_bytes()
    path = tmp_path / "mangled.csv"
    outcomes: list[str | None] = []
    for _ in range(300):
        data = bytearray(sources[list(sources)[rng.integers(len(sources))]])
        for _ in range(rng.integers(1, 4)):
            # The head is short and matters most.
            place = int(rng.integers(400 if rng.random() < 0.5 else len(data)))
            kind = rng.integers(3)
            if kind == 2:
                del data[place : place + int(rng.integers(1, 200))]
            else:
                token = TOKENS[rng.integers(len(TOKENS))]
                data[place : place + int(kind) * len(token)] = token
        path.write_bytes(bytes(data))
        try:
            read_log(path)
            outcomes.append("read")
        except InputError as error:
            outcomes.append(error.file)
    assert set(outcomes) == {"read", str(path)}


def test_rostopic_table_with_fewer_values_than_names_is_refused(tmp_path):
    """A message with two names has two positions."""
    path = FORMATS["rostopic"].write(tmp_path / "log.csv", T, *motion(6))
    spoilt(path, "field.position5", to="other")
    assert refused(path, joints=UR_NAMES).column == "field.position5"


@EACH
def test_a_recording_of_another_robot_names_both_numbers(tmp_path, name):
    """A robot of two joints cannot have a recording of six or seven."""
    _, path, _ = written(tmp_path, name)
    with pytest.raises(InputError, match="joints") as caught:
        read_log(path, 2, kinds=("revolute", "revolute"))
    assert caught.value.exit_code == 2

"""Logs of MATLAB, numpy and ROS."""

import builtins

import h5py
import numpy as np
import pytest
from scipy.io import savemat

from estimation.logs import read_log, read_logs
from robots.common.errors import InputError

rosbags = pytest.importorskip("rosbags", reason="rosbags is not installed")

N = 40
T = 0.004 * np.arange(N)
Q = np.column_stack([np.sin(T), np.cos(T)])
TAU = np.column_stack([10 * T, -T])


def refused(path, **options):
    with pytest.raises(InputError) as caught:
        read_log(path, **options)
    assert caught.value.file == str(path)
    return caught.value


def write_v73(path, **arrays):
    """As MATLAB does it: HDF5 behind a block of 512 bytes, matrices column by column."""
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, array in arrays.items():
            file[name.replace(".", "/")] = np.atleast_2d(array).T if np.ndim(array) == 2 else np.atleast_2d(array)
    with path.open("r+b") as stream:
        stream.write(b"MATLAB 7.3 MAT-file".ljust(512, b" "))


def is_the_log(log):
    np.testing.assert_array_equal(log.t, T)
    np.testing.assert_array_equal(log.q, Q)
    np.testing.assert_array_equal(log.tau, TAU)


@pytest.mark.parametrize("turned", [False, True])
def test_matlab_arrays_are_read(tmp_path, turned):
    """A MAT file of version 5 with t, q and tau is a log, whichever way its matrices lie."""
    arrays = {"t": T, "q": Q, "tau": TAU, "note": "hello"}
    savemat(tmp_path / "log.mat", {name: np.transpose(value) if turned else value for name, value in arrays.items()})
    is_the_log(read_log(tmp_path / "log.mat", 2))


def test_matlab_structure_is_read_by_a_mapping(tmp_path):
    """The fields of a structure are columns of its name and theirs."""
    savemat(tmp_path / "log.mat", {"data": {"time": 1e3 * T, "pos": np.rad2deg(Q), "force": TAU}})
    (tmp_path / "m.yaml").write_text(
        "time: {column: data.time, unit: ms}\nposition: {columns: data.pos, unit: deg}\ntorque: {columns: data.force}\n"
    )
    log = read_log(tmp_path / "log.mat", mapping=tmp_path / "m.yaml")
    np.testing.assert_allclose(log.q, Q, rtol=1e-15)  # there and back, one rounding each
    np.testing.assert_allclose(log.t, T, rtol=1e-15)


def test_matlab_7_3_is_read(tmp_path):
    """A MAT file of version 7.3 is a log as well."""
    path = tmp_path / "log.mat"
    write_v73(path, t=T, q=Q, tau=TAU)
    is_the_log(read_log(path))


def test_numpy_archive_is_read(tmp_path):
    """An .npz archive with t, q and tau is a log."""
    np.savez(tmp_path / "log.npz", t=T, q=Q, tau=TAU, name="x")
    is_the_log(read_log(tmp_path / "log.npz"))


def test_arrays_of_other_lengths_are_refused(tmp_path):
    """A q of another length than t names it."""
    np.savez(tmp_path / "log.npz", t=T, q=Q[:-1], tau=TAU)
    assert refused(tmp_path / "log.npz").column == "q"


def test_archive_of_objects_is_refused(tmp_path):
    """Pickled objects are not loaded: they could run any code."""
    np.savez(tmp_path / "log.npz", t=T, q=np.array([{}, 1], dtype=object), tau=TAU)
    assert "allow_pickle" in str(refused(tmp_path / "log.npz"))


@pytest.mark.parametrize("suffix", ["mat", "npz", "mcap", "bag", "db3"])
@pytest.mark.parametrize("content", [b"", b"x" * 700, b"PK\x03\x04" + b"\0" * 100, b"\0" * 2000])
def test_damaged_files_are_refused(tmp_path, suffix, content):
    """Files that are not what their name says end in one message, without a library's traceback."""
    path = tmp_path / f"log.{suffix}"
    path.write_bytes(content)
    refused(path)


def write_bag(path, kind, *, names=("elbow", "shoulder"), effort=True, topic="/joint_states", stamp=True):
    """Joint states with the joints in another order than the robot's."""
    from rosbags.rosbag1 import Writer as Writer1
    from rosbags.rosbag2 import StoragePlugin
    from rosbags.rosbag2 import Writer as Writer2
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC if kind == "bag" else Stores.ROS2_HUMBLE)
    JointState, Header = (store.types[name] for name in ("sensor_msgs/msg/JointState", "std_msgs/msg/Header"))
    Time = store.types["builtin_interfaces/msg/Time"]
    plugin = StoragePlugin.MCAP if kind == "mcap" else StoragePlugin.SQLITE3
    writer = Writer1(path) if kind == "bag" else Writer2(path, version=9, storage_plugin=plugin)
    with writer:
        connection = writer.add_connection(topic, "sensor_msgs/msg/JointState", typestore=store)
        for row in range(N):
            nanoseconds = round(T[row] * 1e9) + 10**9
            first = {"seq": row} if kind == "bag" else {}
            time = Time(sec=nanoseconds // 10**9 if stamp else 0, nanosec=nanoseconds % 10**9 if stamp else 0)
            message = JointState(
                header=Header(**first, stamp=time, frame_id=""),
                name=list(names),
                position=Q[row, ::-1].copy(),
                velocity=np.array([]),
                effort=TAU[row, ::-1].copy() if effort else np.array([]),
            )
            pack = store.serialize_ros1 if kind == "bag" else store.serialize_cdr
            writer.write(connection, nanoseconds, pack(message, "sensor_msgs/msg/JointState"))
    return path


@pytest.mark.parametrize("kind", ["bag", "db3", "mcap"])
@pytest.mark.parametrize("stamp", [True, False])
def test_ros_bags_are_read_by_joint_name(tmp_path, kind, stamp):
    """A bag of rosbag 1 or 2 gives the joints in the robot's order; without stamps, the recording's times count."""
    path = write_bag(tmp_path / ("log.bag" if kind == "bag" else "log"), kind, stamp=stamp)
    for place in (path,) if kind == "bag" else (path, path / f"log.{kind}"):
        log = read_log(place, 2, joints=["shoulder", "elbow"])
        np.testing.assert_allclose(log.t - 1.0, T, atol=1e-9)  # nanoseconds
        np.testing.assert_array_equal(log.q, Q)
        np.testing.assert_array_equal(log.tau, TAU)


def test_joints_that_a_bag_lacks_are_named(tmp_path):
    """A robot whose joints have other names is refused with those of the messages, and a mapping helps."""
    path = write_bag(tmp_path / "log", "mcap")
    error = refused(path, joints=["J1", "J2"])
    assert "elbow, shoulder" in error.allowed
    assert "mapping" in error.remedy
    (tmp_path / "m.yaml").write_text("joints: [shoulder, elbow]\n")
    np.testing.assert_array_equal(read_log(path, mapping=tmp_path / "m.yaml", joints=["J1", "J2"]).q, Q)


def test_a_bag_with_too_few_joints_asks_to_record_the_others(tmp_path):
    """A mapping cannot name joints that were not recorded: the message does not propose one."""
    path = write_bag(tmp_path / "log", "mcap")
    error = refused(path, joints=["shoulder", "elbow", "wrist"])
    assert "record wrist, too" in error.remedy
    assert "mapping" not in error.remedy


def test_bag_without_effort_is_a_motion(tmp_path):
    """Joint states without effort are refused for want of torque."""
    path = write_bag(tmp_path / "log", "db3", effort=False)
    assert "neither tau" in str(refused(path))
    assert read_log(path, torque=False).tau is None


def test_missing_extra_says_what_to_install(tmp_path, monkeypatch):
    """Without rosbags or h5py the message ends with what to install."""
    path = write_bag(tmp_path / "log.bag", "bag")
    write_v73(tmp_path / "log.mat", t=T, q=Q, tau=TAU)
    original = builtins.__import__

    def refuse(name, *rest):
        if name.split(".")[0] in ("rosbags", "h5py"):
            raise ImportError(name)
        return original(name, *rest)

    monkeypatch.setattr(builtins, "__import__", refuse)
    assert str(refused(path)).endswith("pip install 'robot-oed[ros]'")
    assert "robot-oed[mat]" in str(refused(tmp_path / "log.mat"))


def test_folder_of_rosbag_2_is_one_log_and_a_folder_of_logs_a_campaign(tmp_path):
    """Given a folder, logs are read in the order of their clock, whatever their names and formats."""
    np.savez(tmp_path / "a.npz", t=T + 100.0, q=Q, tau=TAU)
    np.savez(tmp_path / "b.npz", t=T + 50.0, q=Q, tau=TAU)
    write_bag(tmp_path / "c", "mcap")
    (tmp_path / "notes.md").write_text("not a log")
    logs = read_logs(tmp_path, 2, joints=["shoulder", "elbow"])
    assert [log.name for log in logs] == ["c", "b", "a"]


def test_logs_on_clocks_of_their_own_keep_the_order_of_their_names(tmp_path):
    """Logs that all start at zero are in the order of their names."""
    for name in "ba":
        np.savez(tmp_path / f"{name}.npz", t=T, q=Q, tau=TAU)
    assert [log.name for log in read_logs(tmp_path)] == ["a", "b"]


def test_folder_without_logs_is_refused(tmp_path):
    """An empty folder is an input error."""
    with pytest.raises(InputError, match="no logs in the folder"):
        read_logs(tmp_path)

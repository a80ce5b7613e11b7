"""Files that are not what they say: one message each, with the cause and what to do."""

from __future__ import annotations

import numpy as np
import pytest

from estimation.calibrations import TableOptions, read_poses
from estimation.calibrations.pose_tables import poses_to_columns
from robots import load_robot
from robots.common.errors import OedError
from robots.common.tables.table_files import write_table
from robots.geometry_errors import BodyPoses, CameraBoard, Distances, Markers, random_positions, simulate_poses

ERRORS = {"zero_2": 0.005, "link_3_x": 0.002}


@pytest.fixture(scope="module")
def robot():
    return load_robot("ur10")


def columns(robot, measurement, count=30):
    """A table of poses as an instrument would write it."""
    q = random_positions(robot, count, seed=8)
    poses = simulate_poses(robot, q, measurement, ERRORS, noise={"m": 5e-5, "rad": 1e-4, "px": 0.1}, seed=1)
    return poses_to_columns(poses)


def read(robot, tmp_path, table, **options):
    path = tmp_path / "poses.csv"
    write_table(path, table, force=True)
    return read_poses(path, robot, options=TableOptions(**options))


def scaled(names, factor):
    def change(table):
        for name in names:
            table[name] = table[name] * factor

    return change


def swapped(first, second):
    def change(table):
        table[first], table[second] = table[second], table[first]

    return change


def mirrored(table):
    table["y"] = -table["y"]


def shifted_quaternion(table):
    names = ("qx", "qy", "qz", "qw")
    values = [table[name] for name in names]
    for name, value in zip(names, [values[3], *values[:3]], strict=True):
        table[name] = value


def frozen(table):
    for axis in "xyz":
        table[axis] = table[axis].copy()
        table[axis][11] = table[axis][10]


def zeros(table):
    for axis in "xyz":
        table[axis] = np.where(np.arange(30) == 4, 0.0, table[axis])


def one_pose(table):
    for name in list(table):
        table[name] = np.repeat(table[name][:1], 30) + 1e-5 * np.arange(30) * (name in "xyz")


JOINTS = [f"q{i + 1}" for i in range(6)]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("measurement", "change", "cause", "remedy"),
    [
        (Markers(), scaled(JOINTS, 180.0 / np.pi), "probably degrees", "--angles deg"),
        (Markers(), scaled("xyz", 1e3), "probably millimetres", "--lengths mm"),
        (BodyPoses(), scaled("xyz", 1e3), "probably millimetres", "--lengths mm"),
        (Distances(count=2), scaled(("d1", "d2"), 1e3), "millimetres", "--lengths mm"),
        (BodyPoses(), shifted_quaternion, "another order", "--quaternion wxyz"),
        (Markers(), mirrored, "left-handed", "right-handed frame"),
        (Markers(), swapped("q2", "q4"), "joints 2 and 4 swapped", "swap the columns q2 and q4"),
        (Markers(), scaled(("q4",), -1.0), "sign of joint 4", "change the sign of column q4"),
        (Markers(), one_pose, "one pose", "measure different poses"),
        (Markers(), frozen, "the marker was lost", "leave the cells"),
        (Markers(), zeros, "the marker was lost", "leave the cells"),
    ],
    ids=lambda value: getattr(value, "__name__", str(value))[:20],
)
def test_each_fault_has_its_message(robot, tmp_path, measurement, change, cause, remedy):
    """A fault is refused with its cause and what to do, in one line."""
    table = columns(robot, measurement)
    change(table)
    with pytest.raises(OedError) as raised:
        read(robot, tmp_path, table)
    text = str(raised.value)
    assert cause in text
    assert remedy in text
    assert "poses.csv" in text
    assert "\n" not in text


def test_remedies_work(robot, tmp_path):
    """What a message says to do makes the file readable."""
    table = columns(robot, BodyPoses())
    shifted_quaternion(table)
    scaled("xyz", 1e3)(table)
    scaled(JOINTS, 180.0 / np.pi)(table)
    poses = read(robot, tmp_path, table, quaternion="wxyz", lengths="mm", angles="deg")
    np.testing.assert_allclose(poses.q, random_positions(robot, 30, seed=8), atol=1e-12)


def test_few_poses_are_refused(robot, tmp_path):
    """Four poses are too few, and the message says how many are needed."""
    with pytest.raises(OedError, match="4 measured poses; allowed: at least 6"):
        read(robot, tmp_path, columns(robot, Markers(), count=4))


def test_empty_cells_were_not_measured(robot, tmp_path):
    """Rows without a measurement are left out; of several markers, the others of a row count."""
    table = columns(robot, Markers(count=2))
    table["x1"] = np.where(np.arange(30) == 3, np.nan, table["x1"])
    for name in ("x1", "y1", "z1", "x2", "y2", "z2"):
        table[name] = np.where(np.arange(30) == 9, np.nan, table[name])
    poses = read(robot, tmp_path, table)
    assert len(poses) == 29
    assert np.isnan(poses.observed).sum() == 1


def test_names_and_joints_are_checked(robot, tmp_path):
    """Missing columns, text and boards without a description are refused by name; names of joints are accepted."""
    table = columns(robot, Markers())
    named = {robot.joint_names[JOINTS.index(k)] if k in JOINTS else k: v for k, v in table.items()}
    assert len(read(robot, tmp_path, named)) == 30
    for drop, message in (("q3", "no column q3"), ("x", "no column of a measurement")):
        with pytest.raises(OedError, match=message):
            read(robot, tmp_path, {k: v for k, v in table.items() if k != drop})
    with pytest.raises(OedError, match="--board"):
        read(robot, tmp_path, {**{k: table[k] for k in JOINTS}, "u1": table["x"], "v1": table["y"]})
    with pytest.raises(OedError, match="'cm'"):
        TableOptions(lengths="cm")
    with pytest.raises(OedError, match="corners"):
        CameraBoard(rows=1)


@pytest.mark.parametrize("joints", ["J{} [deg]", "A{} (deg)", "joint_{} [degrees]", "Axis {} [°]"])
def test_names_and_units_of_trackers_and_controllers_are_read(robot, tmp_path, joints):
    """Joints as controllers call them and positions as trackers do, with units in the names, are read in SI."""
    table = columns(robot, BodyPoses())
    renamed = {joints.format(i + 1): np.rad2deg(table[f"q{i + 1}"]) for i in range(6)}
    renamed |= {f"Position {axis.upper()} [mm]": 1e3 * table[axis] for axis in "xyz"}
    renamed |= {f"Rotation {axis.upper()}": table[f"q{axis}"] for axis in "xyzw"} | {"RMS": np.ones(30)}
    poses, plain = read(robot, tmp_path, renamed), read(robot, tmp_path, table)
    np.testing.assert_allclose(poses.q, plain.q, atol=1e-12)
    np.testing.assert_allclose(poses.observed, plain.observed, atol=1e-12)
    assert poses.source["not_read"] == ["RMS"]


def test_units_in_the_header_go_before_the_options(robot, tmp_path):
    """A unit that the file states counts, whatever the options say; one that is none is refused by its column."""
    table = columns(robot, Markers())
    path = tmp_path / "poses.csv"
    write_table(path, {**table, "x": 1e3 * table["x"]}, units={"x": "mm", "y": "m", "z": "m"}, force=True)
    poses = read_poses(path, robot, options=TableOptions(lengths="mm"))
    np.testing.assert_allclose(poses.observed, np.column_stack([table[axis] for axis in "xyz"]), atol=1e-12)
    write_table(path, table, units={"x": "inch"}, force=True)
    with pytest.raises(OedError, match="column x: unit 'inch'; allowed: m or mm"):
        read_poses(path, robot)


@pytest.mark.parametrize(
    ("start", "system"), [("Format Version,1.23,Take", "Motive"), ("NO_OF_FRAMES\t12", "Qualisys")]
)
def test_recordings_of_motion_capture_are_refused(robot, tmp_path, start, system):
    """An export with a row for each frame says what has to be done with it."""
    path = tmp_path / "take.csv"
    path.write_text(f"{start}\n\n,Type,Rigid Body\n")
    with pytest.raises(OedError, match=f"{system}.*average the frames"):
        read_poses(path, robot)


@pytest.mark.parametrize(
    ("known", "message"),
    [
        ({"tracker": np.zeros(3)}, "tracker is known as a point; allowed: tracker=X,Y,Z,ROLL,PITCH,YAW"),
        ({"marker_1": np.eye(4)}, "marker_1 is known as a pose; allowed: marker_1=X,Y,Z"),
        ({"lens": np.zeros(3)}, "no 'lens'; allowed: tracker, marker_1"),
    ],
)
def test_known_parts_of_another_kind_are_refused(robot, tmp_path, known, message):
    """A pose that is known as a point, a point that is known as a pose, and a part that there is not."""
    with pytest.raises(OedError, match=message):
        read(robot, tmp_path, columns(robot, Markers()), known=known)

"""Each type of ROS message with joint states is read from bags, with and without its definition in the bag."""

import numpy as np
import pytest

from estimation.logs import LogMapping, read_log
from estimation.logs.ros_messages import MESSAGES
from robots.common.errors import InputError
from tests.estimation.logs.recordings import T, motion

pytest.importorskip("rosbags", reason="rosbags is not installed")

pytestmark = pytest.mark.slow

NAMES = [f"panda_joint{joint}" for joint in range(1, 8)]
ORDER = [4, 2, 0, 6, 1, 5, 3]
Q, DQ, TAU = motion(7)

JOINT_STATE = "sensor_msgs/msg/JointState"
DEFINITIONS = {
    "control_msgs/msg/JointTrajectoryControllerState": [
        "std_msgs/Header header\nstring[] joint_names\n"
        "trajectory_msgs/JointTrajectoryPoint desired\ntrajectory_msgs/JointTrajectoryPoint actual\n"
        "trajectory_msgs/JointTrajectoryPoint error\n",
        "std_msgs/Header header\nstring[] joint_names\n"
        "trajectory_msgs/JointTrajectoryPoint reference\ntrajectory_msgs/JointTrajectoryPoint feedback\n"
        "trajectory_msgs/JointTrajectoryPoint error\ntrajectory_msgs/JointTrajectoryPoint output\n",
    ],
    # The fields up to the torques, and some of those behind them.
    "franka_msgs/msg/FrankaRobotState": [
        "std_msgs/Header header\nfranka_msgs/CollisionIndicators collision_indicators\n"
        "sensor_msgs/JointState measured_joint_state\nsensor_msgs/JointState desired_joint_state\n"
        "float64[7] dtau_j\nfloat64 time\n"
        + "=" * 80
        + "\nMSG: franka_msgs/CollisionIndicators\n"
        + "".join(
            f"geometry_msgs/Vector3 is_cartesian_{name}\n"
            for name in ("linear_collision", "angular_collision", "linear_contact", "angular_contact")
        )
        + "float64[7] is_joint_collision\nfloat64[7] is_joint_contact\n"
    ],
    "franka_msgs/msg/FrankaState": [
        "std_msgs/Header header\nfloat64[7] q\nfloat64[7] dq\nfloat64[7] tau_J\nfloat64[7] tau_ext_hat_filtered\n"
    ],
    "lbr_fri_idl/msg/LBRState": [
        "float64 sample_time\nuint32 time_stamp_sec\nuint32 time_stamp_nano_sec\nfloat64[7] measured_joint_position\n"
        "float64[7] commanded_joint_position\nfloat64[7] measured_torque\nfloat64[7] external_torque\n"
    ],
}


class Bag:
    """A bag of ROS 2 (SQLite, MCAP) or ROS 1, to which messages are added."""

    def __init__(self, path, kind, definitions=(), *, names=NAMES):
        from rosbags.rosbag1 import Writer as Writer1
        from rosbags.rosbag2 import StoragePlugin
        from rosbags.rosbag2 import Writer as Writer2
        from rosbags.typesys import Stores, get_types_from_msg, get_typestore

        self.path, self.kind, self.names = path, kind, list(names)
        self.store = get_typestore(Stores.ROS1_NOETIC if kind == "bag" else Stores.ROS2_HUMBLE)
        for name, text in definitions:
            self.store.register(get_types_from_msg(text, name))
        plugin = StoragePlugin.MCAP if kind == "mcap" else StoragePlugin.SQLITE3
        self.writer = Writer1(path) if kind == "bag" else Writer2(path, version=9, storage_plugin=plugin)
        self.writer.open()
        self.connections = {}

    def close(self, *, definitions=True):
        """Ends the bag; ``definitions=False`` removes those of the types, as older versions of ROS 2 wrote it."""
        self.writer.close()
        if not definitions:
            import sqlite3

            with sqlite3.connect(next(self.path.glob("*.db3"))) as database:
                database.execute("DELETE FROM message_definitions")
        return self.path

    def make(self, name, /, **fields):
        return self.store.types[name](**fields)

    def header(self, row):
        stamp = self.make("builtin_interfaces/msg/Time", sec=1, nanosec=round(T[row] * 1e9))
        return self.make(
            "std_msgs/msg/Header", **({"seq": row} if self.kind == "bag" else {}), stamp=stamp, frame_id=""
        )

    def state(self, row, *, tau=TAU, names=None, order=ORDER, dq=DQ, stamped=True):
        header = self.header(row)
        if not stamped:
            header.stamp = self.make("builtin_interfaces/msg/Time", sec=0, nanosec=0)
        return self.make(
            JOINT_STATE,
            header=header,
            name=[(names or self.names)[joint] for joint in order],
            position=Q[row, order],
            velocity=DQ[row, order] if dq is not None else np.array([]),
            effort=TAU[row, order] if tau is not None else np.array([]),
        )

    def point(self, row, *, right):
        sign = 1.0 if right else -1.0
        return self.make(
            "trajectory_msgs/msg/JointTrajectoryPoint",
            positions=sign * Q[row, ORDER],
            velocities=sign * DQ[row, ORDER],
            accelerations=np.array([]),
            effort=sign * TAU[row, ORDER],
            time_from_start=self.make("builtin_interfaces/msg/Duration", sec=0, nanosec=0),
        )

    def add(self, topic, name, row, message):
        if topic not in self.connections:
            self.connections[topic] = self.writer.add_connection(topic, name, typestore=self.store)
        pack = self.store.serialize_ros1 if self.kind == "bag" else self.store.serialize_cdr
        self.writer.write(self.connections[topic], 10**9 + round(T[row] * 1e9), pack(message, name))

    def message(self, name, row):
        """A message of any type of the family."""
        if name == JOINT_STATE:
            return self.state(row)
        if name.startswith("control_msgs"):
            fields = list(self.store.types[name].__dataclass_fields__)
            points = {key: self.point(row, right=key in ("feedback", "actual")) for key in fields[2:6] if key[0] != "_"}
            return self.make(
                name, header=self.header(row), joint_names=[self.names[joint] for joint in ORDER], **points
            )
        if name.endswith("FrankaRobotState"):
            zero = self.make("geometry_msgs/msg/Vector3", x=0.0, y=0.0, z=0.0)
            flags = self.make("franka_msgs/msg/CollisionIndicators", **_indicators(zero))
            return self.make(
                name,
                header=self.header(row),
                collision_indicators=flags,
                measured_joint_state=self.state(row),
                desired_joint_state=self.state(row, tau=None),
                dtau_j=np.zeros(7),
                time=0.0,
            )
        if name.endswith("FrankaState"):
            return self.make(
                name, header=self.header(row), q=Q[row], dq=DQ[row], tau_J=TAU[row], tau_ext_hat_filtered=np.zeros(7)
            )
        return self.make(
            name,
            sample_time=0.004,
            time_stamp_sec=1,
            time_stamp_nano_sec=round(T[row] * 1e9),
            measured_joint_position=Q[row],
            commanded_joint_position=-Q[row],
            measured_torque=TAU[row],
            external_torque=np.zeros(7),
        )


def _indicators(zero):
    vectors = ("linear_collision", "angular_collision", "linear_contact", "angular_contact")
    return {f"is_cartesian_{name}": zero for name in vectors} | {
        "is_joint_collision": np.zeros(7),
        "is_joint_contact": np.zeros(7),
    }


def recorded(path, kind, name, definition=None, *, definitions=True):
    bag = Bag(path, kind, [] if definition is None else [(name, definition)])
    for row in range(len(T)):
        bag.add("/state", name, row, bag.message(name, row))
    return bag.close(definitions=definitions)


CASES = [(JOINT_STATE, None), *((name, text) for name, texts in DEFINITIONS.items() for text in texts)]


def is_the_motion(log, *, velocity=True):
    np.testing.assert_allclose(log.t - 1.0, T, atol=1e-9)  # nanoseconds
    np.testing.assert_array_equal(log.q, Q)
    np.testing.assert_array_equal(log.tau, TAU)
    if velocity:
        np.testing.assert_array_equal(log.dq, DQ)


@pytest.mark.parametrize(
    ("kind", "name", "definition"),
    [("mcap", *case) for case in CASES] + [("db3", *CASES[1]), ("bag", *CASES[1]), ("bag", *CASES[-2])],
)
def test_state_is_read_in_the_robots_order(tmp_path, kind, name, definition):
    """Each type gives measured positions and torques of a bag's folder and of its file, by joint names."""
    path = recorded(tmp_path / ("log.bag" if kind == "bag" else "log"), kind, name, definition)
    for place in (path,) if kind == "bag" else (path, path / f"log.{kind}"):
        log = read_log(place, 7, joints=NAMES)
        is_the_motion(log, velocity="LBR" not in name)
        assert log.metadata["torque_source"]["format"] == f"{name} of /state"
        assert log.metadata["repairs"][0]["name"] == "torque_source"


@pytest.mark.parametrize(("name", "definition"), CASES)
def test_bag_without_definitions_is_read_where_versions_agree(tmp_path, name, definition):
    """Older SQLite bags hold no definitions: known types are read, and for others the message says what to do."""
    path = recorded(tmp_path / "log", "db3", name, definition, definitions=False)
    if name in (JOINT_STATE, *(message.kind for message in MESSAGES if message.definition)):
        is_the_motion(read_log(path, 7, joints=NAMES))
        return
    with pytest.raises(InputError, match=f"no definition of {name}") as caught:
        read_log(path, 7, joints=NAMES)
    assert "mcap" in caught.value.remedy


def test_every_type_has_a_case():
    """The family's contract covers all of its members."""
    assert {name for name, _ in CASES} == {message.kind for message in MESSAGES}


def test_topic_with_efforts_of_the_robots_joints_is_chosen(tmp_path):
    """Of several topics, the one with the robot's joints and with efforts is read, without a mapping."""
    bag = Bag(tmp_path / "log", "mcap", [(name, texts[0]) for name, texts in DEFINITIONS.items()])
    for row in range(len(T)):
        bag.add("/gripper/joint_states", JOINT_STATE, row, bag.state(row, names=[f"finger{j}" for j in range(7)]))
        bag.add("/joint_states", JOINT_STATE, row, bag.state(row, tau=None))
        name = "franka_msgs/msg/FrankaRobotState"
        bag.add("/franka/state", name, row, bag.message(name, row))
        name = "control_msgs/msg/JointTrajectoryControllerState"
        bag.add("/controller/state", name, row, bag.message(name, row))
    path = bag.close()
    log = read_log(path, 7, joints=NAMES)
    is_the_motion(log)
    assert "/franka/state" in log.metadata["torque_source"]["format"]
    log = read_log(path, 7, joints=NAMES, mapping=LogMapping(topic="/controller/state"))
    is_the_motion(log)
    assert "/controller/state" in log.metadata["torque_source"]["format"]
    with pytest.raises(InputError, match="no joint states in the topic /other"):
        read_log(path, 7, joints=NAMES, mapping=LogMapping(topic="/other"))


def test_topics_that_cannot_be_distinguished_are_listed(tmp_path):
    """Two topics with all joints and efforts need a choice."""
    bag = Bag(tmp_path / "log", "db3")
    for row in range(3):
        for topic in ("/left/joint_states", "/right/joint_states"):
            bag.add(topic, JOINT_STATE, row, bag.state(row))
    path = bag.close()
    with pytest.raises(InputError, match="/left/joint_states, /right/joint_states") as caught:
        read_log(path, 7, joints=NAMES)
    assert "topic" in caught.value.remedy


def test_bag_without_joint_states_lists_its_topics(tmp_path):
    """A bag of other messages is refused with what it has."""
    bag = Bag(tmp_path / "log", "db3")
    for row in range(3):
        bag.add("/tick", "std_msgs/msg/Header", row, bag.header(row))
    with pytest.raises(InputError, match="no topics with joint states") as caught:
        read_log(bag.close(), 7, joints=NAMES)
    assert "/tick (std_msgs/msg/Header)" in caught.value.allowed


def test_message_with_other_lengths_is_named(tmp_path):
    """A message whose names and positions do not match is refused with its number."""
    bag = Bag(tmp_path / "log", "db3")
    for row in range(4):
        state = bag.state(row)
        if row == 2:
            state = bag.make(JOINT_STATE, **{**vars(state), "position": state.position[:-1]})
        bag.add("/joint_states", JOINT_STATE, row, state)
    with pytest.raises(InputError, match="7 names for 6 positions") as caught:
        read_log(bag.close(), 7, joints=NAMES)
    assert caught.value.row == 3


def test_prefixes_of_joint_names_are_understood(tmp_path):
    """A bag of fr3_joint1 to fr3_joint7 is one of panda_joint1 to panda_joint7."""
    bag = Bag(tmp_path / "log", "db3", names=[f"fr3_joint{joint}" for joint in range(1, 8)])
    for row in range(len(T)):
        bag.add("/joint_states", JOINT_STATE, row, bag.state(row))
    is_the_motion(read_log(bag.close(), 7, joints=NAMES))


def test_torque_without_effort_says_so(tmp_path):
    """Joint states without effort are refused with the topic's name."""
    bag = Bag(tmp_path / "log", "db3")
    for row in range(3):
        bag.add("/joint_states", JOINT_STATE, row, bag.state(row, tau=None))
    path = bag.close()
    with pytest.raises(InputError, match="neither tau1") as caught:
        read_log(path, 7, joints=NAMES)
    assert "/joint_states" in caught.value.remedy


def test_velocities_with_gaps_are_left_out(tmp_path):
    """Velocities that every fourth message lacks are left out with their number; the rest of the log is whole."""
    bag = Bag(tmp_path / "log", "db3")
    for row in range(len(T)):
        bag.add("/joint_states", JOINT_STATE, row, bag.state(row, dq=None if row % 4 == 0 else DQ))
    log = read_log(bag.close(), 7, joints=NAMES)
    is_the_motion(log, velocity=False)
    assert log.dq is None
    note = next(note for note in log.metadata["repairs"] if note["name"] == "velocity_gaps")
    assert f"10 rows of {len(T)}" in note["text"]


def test_messages_without_effort_are_left_out(tmp_path):
    """A second publisher that repeats positions costs nothing but its own messages."""
    bag = Bag(tmp_path / "log", "db3")
    for row in range(len(T)):
        bag.add("/joint_states", JOINT_STATE, row, bag.state(row))
        bag.add("/joint_states", JOINT_STATE, row, bag.state(row, tau=None))
    log = read_log(bag.close(), 7, joints=NAMES)
    is_the_motion(log)
    note = next(note for note in log.metadata["repairs"] if note["name"] == "incomplete_rows")
    assert f"{len(T)} of {2 * len(T)} rows have no number in tau1" in note["text"]


def test_halves_of_the_joints_in_turns_are_put_together(tmp_path):
    """Two publishers with some joints each give one log; in between, the motion is a straight line."""
    bag = Bag(tmp_path / "log", "db3")
    for row in range(len(T)):
        bag.add("/joint_states", JOINT_STATE, row, bag.state(row, order=[0, 1, 2] if row % 2 else [6, 3, 5, 4]))
    log = read_log(bag.close(), 7, joints=NAMES)
    rows = np.round((log.t - 1.0) / 0.004).astype(int)
    assert len(log) > len(T) // 2 - 2
    # |q''| <= 1 rad/s2 and |tau''| <= 40 N m/s2; a straight line over 8 ms is off by an eighth of that times h^2.
    np.testing.assert_allclose(log.q, Q[rows], atol=0.008**2 / 8)
    np.testing.assert_allclose(log.tau, TAU[rows], atol=40 * 0.008**2 / 8)
    assert log.q[0].tolist() != Q[rows[0]].tolist()


def test_one_message_without_a_stamp_is_left_out(tmp_path):
    """Its time is unknown; messages that all lack a stamp have the times of the recording."""
    for lacking, rows in (([7], 39), (range(len(T)), 40)):
        bag = Bag(tmp_path / f"log{rows}", "db3")
        for row in range(len(T)):
            bag.add("/joint_states", JOINT_STATE, row, bag.state(row, stamped=row not in lacking))
        log = read_log(bag.close(), 7, joints=NAMES)
        assert len(log) == rows
        np.testing.assert_allclose(log.t - 1.0, np.delete(T, [7] if rows == 39 else []), atol=1e-9)


def pasted(error, folder):
    """Saves the mapping that a message prints."""
    (folder / "mapping.yaml").write_text(str(error).split("mapping.yaml:\n", 1)[1])
    return folder / "mapping.yaml"


def test_the_mapping_of_a_message_reads_the_bag(tmp_path):
    """The joints or the topic that a message prints read the bag, pasted as they are."""
    names = [f"axis_{letter}" for letter in "abcdefg"]
    bag = Bag(tmp_path / "other", "db3", names=names)
    for row in range(len(T)):
        bag.add("/joint_states", JOINT_STATE, row, bag.state(row, order=range(7)))
    path = bag.close()
    with pytest.raises(InputError, match="no message has the joints") as caught:
        read_log(path, 7, joints=NAMES)
    is_the_motion(read_log(path, 7, joints=NAMES, mapping=pasted(caught.value, tmp_path)))
    bag = Bag(tmp_path / "two", "db3")
    for row in range(len(T)):
        for topic in ("/left/joint_states", "/right/joint_states"):
            bag.add(topic, JOINT_STATE, row, bag.state(row))
    path = bag.close()
    with pytest.raises(InputError, match="2 topics") as caught:
        read_log(path, 7, joints=NAMES)
    is_the_motion(read_log(path, 7, joints=NAMES, mapping=pasted(caught.value, tmp_path)))


def test_topics_without_the_robots_joints_say_what_is_missing(tmp_path):
    """Of several topics with some joints each, none is offered as a choice that would not help."""
    bag = Bag(tmp_path / "log", "db3")
    for row in range(3):
        bag.add("/left/joint_states", JOINT_STATE, row, bag.state(row, order=[0, 1, 2]))
        bag.add("/right/joint_states", JOINT_STATE, row, bag.state(row, order=[3, 4, 5, 6]))
    with pytest.raises(InputError, match="no message has the joints") as caught:
        read_log(bag.close(), 7, joints=NAMES)
    assert "record panda_joint4, panda_joint5, panda_joint6, panda_joint7, too" in caught.value.remedy

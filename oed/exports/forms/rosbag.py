"""ROS 2 bags of the planned motion: sensor_msgs/JointState on /joint_states, as SQLite or MCAP."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from oed.exports.forms.base import NANOSECONDS, Array, ExportOptions, Form
from robots.common.errors import InputError
from robots.robot import Robot
from robots.signals import Motion

TOPIC, TYPE = "/joint_states", "sensor_msgs/msg/JointState"
ROSBAG_VERSION = 8
"""Version of the bag's description; ROS 2 from Humble on reads it."""


class Rosbag(Form):
    """The storage file of a rosbag 2, as ``ros2 bag play`` takes it; messages hold positions and velocities."""

    name: ClassVar[str] = "rosbag"
    suffixes: ClassVar[tuple[str, ...]] = (".db3",)
    plugin: ClassVar[str] = "SQLITE3"

    def write(self, motion: Motion, robot: Robot, options: ExportOptions, suffix: str) -> bytes:
        """See `Form.write`."""
        rosbag2, store = _rosbags()
        message, header, time = (
            store.types[kind] for kind in (TYPE, "std_msgs/msg/Header", "builtin_interfaces/msg/Time")
        )
        names = list(robot.joint_names)
        stamps = np.round((motion.t - motion.t[0]) * NANOSECONDS).astype(np.int64).tolist()
        with tempfile.TemporaryDirectory() as folder:
            bag = Path(folder) / "bag"
            with rosbag2.Writer(
                bag, version=ROSBAG_VERSION, storage_plugin=rosbag2.StoragePlugin[self.plugin]
            ) as writer:
                connection = writer.add_connection(TOPIC, TYPE, typestore=store)
                for stamp, q, dq in zip(stamps, motion.q, motion.dq, strict=True):
                    state = message(
                        header=header(stamp=time(sec=stamp // NANOSECONDS, nanosec=stamp % NANOSECONDS), frame_id=""),
                        name=names,
                        position=q,
                        velocity=dq,
                        effort=np.zeros(0),
                    )
                    writer.write(connection, stamp, store.serialize_cdr(state, TYPE))
            return next(bag.glob(f"*{suffix}")).read_bytes()

    def read(self, content: bytes, robot: Robot, suffix: str) -> tuple[Array, Array]:
        """See `Form.read`; joints may stand in any order."""
        _, store = _rosbags()
        names = list(robot.joint_names)
        t, q = [], []
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / f"bag{suffix}"
            file.write_bytes(content)
            with _as_input_error(names), _reader(file, store) as reader:
                chosen = [connection for connection in reader.connections if connection.topic == TOPIC]
                for connection, _, raw in reader.messages(connections=chosen):
                    state = reader.deserialize(raw, connection.msgtype)
                    order = [list(state.name).index(name) for name in names]
                    t.append(state.header.stamp.sec + state.header.stamp.nanosec / NANOSECONDS)
                    q.append(np.asarray(state.position)[order])
        if not t:
            raise InputError(f"no messages on {TOPIC}", allowed="a bag of this form")
        return np.array(t), np.array(q)


class Mcap(Rosbag):
    """The same as an MCAP file."""

    name: ClassVar[str] = "mcap"
    suffixes: ClassVar[tuple[str, ...]] = (".mcap",)
    plugin: ClassVar[str] = "MCAP"


def _rosbags() -> tuple[Any, Any]:
    """Gives the library's module of rosbag 2 and the message types of ROS 2."""
    try:
        from rosbags import rosbag2
        from rosbags.typesys import Stores, get_typestore
    except ImportError as error:
        raise InputError(
            "ROS bags need the package rosbags, which is not installed", remedy="pip install 'robot-oed[ros]'"
        ) from error
    return rosbag2, get_typestore(Stores.ROS2_HUMBLE)


@contextmanager
def _reader(file: Path, store: Any) -> Iterator[Any]:
    from rosbags.highlevel import AnyReader

    with AnyReader([file], default_typestore=store) as reader:
        yield reader


@contextmanager
def _as_input_error(names: list[str]) -> Iterator[None]:
    """Says of whatever a foreign file makes the library raise that it is no bag of this form."""
    try:
        yield
    except InputError:
        raise
    except Exception as error:
        text = (str(error).splitlines() or [type(error).__name__])[0]
        raise InputError(f"no bag with {TYPE} of {', '.join(names)} ({text})", allowed="a bag of this form") from error

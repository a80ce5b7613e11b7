"""ROS bags: rosbag 1, rosbag 2 (SQLite or MCAP) and MCAP files with joint states, as tables."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from robots.common.errors import InputError
from robots.common.tables.table import Column, Table

_TYPE = "sensor_msgs/msg/JointState"


def read_bag(path: Path, *, topic: str | None = None, joints: Sequence[str] | None = None) -> Table:
    """Reads the messages ``sensor_msgs/JointState`` of a bag.

    Time is that of the headers, or that of the recording where the headers carry none. Joints are found by the
    messages' names, not by their place.

    Args:
        path: a ``.bag``, ``.db3`` or ``.mcap`` file, or the folder of a rosbag 2.
        topic: of the messages; needed where several topics carry joint states.
        joints: names in the robot's order; without them the first message's names count in their own order, and
            messages without names by place.

    Returns:
        Columns ``t, q1.., dq1.., tau1..`` as far as the messages carry them.

    Raises:
        InputError: rosbags is not installed, no bag, no joint states, or joints that the messages do not have.
    """
    try:
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_typestore
    except ImportError as error:
        raise InputError(
            "reading ROS bags needs the package rosbags, which is not installed",
            file=path,
            remedy="pip install 'robot-oed[ros]'",
        ) from error
    messages: list[tuple[float, Any]] = []
    try:
        with AnyReader([path], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
            connections = [c for c in reader.connections if c.msgtype == _TYPE and topic in (None, c.topic)]
            topics = sorted({connection.topic for connection in connections})
            others = sorted({connection.topic for connection in reader.connections})
            if len(topics) == 1:
                for connection, received, raw in reader.messages(connections=connections):
                    message = reader.deserialize(raw, connection.msgtype)
                    stamp = message.header.stamp
                    sent = stamp.sec + 1e-9 * stamp.nanosec
                    messages.append((sent if sent > 0 else 1e-9 * received, message))
    # A damaged bag fails anywhere in the reader, which raises whatever comes up.
    except Exception as error:
        text = str(error).splitlines()
        raise InputError(
            f"the ROS bag cannot be read ({text[0] if text else type(error).__name__})",
            file=path,
            remedy="check it with `ros2 bag info`, or record it again",
        ) from error
    if len(topics) != 1:
        raise InputError(
            f"{len(topics) or 'no'} topics with joint states" + (f": {', '.join(topics)}" if topics else ""),
            file=path,
            allowed=f"one {_TYPE}" + ("" if topics else f"; the bag has {', '.join(others) or 'no topics'}"),
            remedy="choose one with `topic` in a mapping (--mapping)" if topics else None,
        )
    if not messages:
        raise InputError("no messages", file=path, column=topics[0])
    return _table(path, messages, joints)


def _table(path: Path, messages: list[tuple[float, Any]], joints: Sequence[str] | None) -> Table:
    first = list(messages[0][1].name)
    names = list(joints) if joints is not None else first
    rows: dict[str, list[list[float]]] = {"q": [], "dq": [], "tau": []}
    times: list[float] = []
    for row, (time, message) in enumerate(messages, start=1):
        order = _order(path, row, list(message.name), names, len(message.position))
        if order is None:
            continue  # a message of other joints, such as a gripper's
        times.append(time)
        for prefix, values in (("q", message.position), ("dq", message.velocity), ("tau", message.effort)):
            if len(values) not in (0, len(message.position)):
                raise InputError(
                    f"{len(values)} values for {len(message.position)} joints", file=path, column=prefix, row=row
                )
            rows[prefix].append([float(values[place]) for place in order] if len(values) else [])
    if not times:
        raise InputError(
            f"no message has the joints {', '.join(names)}",
            file=path,
            allowed=f"names in the messages: {', '.join(first) or 'none'}",
            remedy="list `joints` in a mapping, in the robot's order",
        )
    columns: dict[str, Column] = {"t": np.array(times)}
    for prefix, values in rows.items():
        lengths = {len(row) for row in values}
        if lengths == {0}:
            continue
        if len(lengths) > 1:
            raise InputError("only some messages carry values", file=path, column=f"{prefix}1")
        matrix = np.array(values)
        columns.update({f"{prefix}{joint + 1}": matrix[:, joint].copy() for joint in range(matrix.shape[1])})
    return Table(columns=columns, metadata={"joints": names}, path=path, first_row=1)


def _order(path: Path, row: int, found: list[str], wanted: list[str], count: int) -> list[int] | None:
    """Where each wanted joint stands in a message; None if the message is of other joints."""
    if not found:
        if wanted and len(wanted) != count:
            raise InputError(f"{count} joints without names", file=path, row=row, allowed=f"{len(wanted)}")
        return list(range(count))
    if len(found) != count:
        raise InputError(f"{len(found)} names for {count} positions", file=path, row=row)
    if len(set(found)) < len(found):
        raise InputError(f"a joint name appears twice: {', '.join(found)}", file=path, row=row)
    if not set(wanted) <= set(found):
        return None
    return [found.index(name) for name in wanted]

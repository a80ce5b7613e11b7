"""ROS bags: rosbag 1, rosbag 2 (SQLite or MCAP) and MCAP files with the state of joints, as tables."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from estimation.logs.mappings.suggestions import save_mapping
from estimation.logs.readers.joint_names import places
from estimation.logs.ros_messages import MESSAGES, JointMessage, JointValues
from estimation.logs.torque_source import NO_TORQUE, TorqueSource
from robots.common.errors import InputError
from robots.common.tables.table import Column, Table

_LOOKED_AT = 20
"""Messages of each topic that are looked at: a topic may have several publishers, with joints of their own."""

_TYPES = {message.kind: message for message in MESSAGES}


@dataclass(frozen=True, kw_only=True)
class _Topic:
    """A topic with joint states.

    Attributes:
        name: of the topic.
        message: its type.
        found: the names of joints in its first messages; empty if they have none.
        called: its names of the robot's joints, in the robot's order; empty for joints by their place, None if they are
            not in it.
        has_effort: whether one of its first messages has efforts of these joints.
    """

    name: str
    message: JointMessage
    found: tuple[str, ...]
    called: tuple[str, ...] | None
    has_effort: bool


def read_bag(path: Path, *, topic: str | None = None, joints: Sequence[str] | None = None) -> Table:
    """Reads the joint states of a bag: the topic that has the robot's joints and their efforts.

    Time is that of the messages, or that of the recording where they carry none. Joints are found by the messages'
    names, not by their place.

    Args:
        path: a ``.bag``, ``.db3`` or ``.mcap`` file, or the folder of a rosbag 2.
        topic: of the messages; needed where several topics carry states of these joints.
        joints: names in the robot's order; without them the first message's names count in their own order, and
            messages without names by place.

    Returns:
        Columns ``t, q1.., dq1.., tau1.., qref1..`` as far as the messages carry them.

    Raises:
        InputError: rosbags is not installed, no bag, no joint states, or joints that the messages do not have.
    """
    try:
        from rosbags.highlevel import AnyReader
    except ImportError as error:
        raise InputError(
            "reading ROS bags needs the package rosbags, which is not installed",
            file=path,
            remedy="pip install 'robot-oed[ros]'",
        ) from error
    messages: list[tuple[float, JointValues]] = []
    try:
        with AnyReader([path], default_typestore=_typestore()) as reader:
            chosen = _choose(path, reader, topic, joints)
            for received, raw in _raw(reader, chosen.name, chosen.message):
                messages.append((1e-9 * received, chosen.message.values(_unpacked(reader, raw, chosen.message.kind))))
    except InputError:
        raise
    # A damaged bag fails anywhere in the reader, which raises whatever comes up.
    except Exception as error:
        text = str(error).splitlines()
        raise InputError(
            f"the ROS bag cannot be read ({text[0] if text else type(error).__name__})",
            file=path,
            remedy="check it with `ros2 bag info`, or record it again",
        ) from error
    return _table(path, chosen, messages, joints)


@lru_cache(maxsize=1)
def _typestore() -> Any:
    """The types of bags that hold no definitions: those of ROS 2, and the beginnings of messages known here."""
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    for message in MESSAGES:
        if message.definition:
            store.register(get_types_from_msg(message.definition, message.kind))
    return store


def _raw(reader: Any, topic: str, message: JointMessage) -> Iterator[tuple[int, bytes]]:
    """Gives the messages of a topic, which may have several publishers."""
    same = [c for c in reader.connections if (c.topic, c.msgtype) == (topic, message.kind)]
    for _, received, raw in reader.messages(connections=same):
        yield received, raw


def _unpacked(reader: Any, raw: bytes, kind: str) -> Any:
    """Reads a message; of one whose beginning only is known, that."""
    if not reader.is2 or len(raw) < 4:
        return reader.deserialize(raw, kind)
    definition = reader.typestore.get_msgdef(kind)
    unpack = definition.deserialize_cdr_le if raw[1] else definition.deserialize_cdr_be
    return unpack(raw[4:], 0, definition.cls, reader.typestore)[0]


def _choose(path: Path, reader: Any, topic: str | None, joints: Sequence[str] | None) -> _Topic:
    """Finds the topic: with the robot's joints before others, with efforts before others, by type."""
    candidates, unknown = [], []
    for name, kind in sorted({(connection.topic, connection.msgtype) for connection in reader.connections}):
        message = _TYPES.get(kind)
        if message is None or topic not in (None, name):
            continue
        if kind not in reader.typestore.fielddefs:
            unknown.append(kind)
            continue
        seen = [
            message.values(_unpacked(reader, raw, kind)) for _, raw in islice(_raw(reader, name, message), _LOOKED_AT)
        ]
        if seen:
            candidates.append(_topic(name, message, seen, joints))
    if not candidates:
        others = sorted({f"{c.topic} ({c.msgtype})" for c in reader.connections})
        if unknown:
            raise InputError(
                f"the bag holds no definition of {unknown[0]}",
                file=path,
                remedy="record as MCAP (`ros2 bag record -s mcap`), or convert the bag where the type is installed",
            )
        raise InputError(
            "no topics with joint states" if topic is None else f"no joint states in the topic {topic}",
            file=path,
            allowed=f"one of {', '.join(_TYPES)}; the bag has {', '.join(others) or 'no topics'}",
        )
    fitting = [c for c in candidates if c.called is not None] or candidates
    best = [c for c in fitting if c.has_effort] or fitting
    best = [c for c in best if c.message is best[0].message] if topic else _preferred(best)
    names = sorted({candidate.name for candidate in best})
    if best[0].called is None:
        # The topic whose joints could be the robot's under other names; its message says what it has.
        return next((c for c in best if len(c.found) == len(joints or ())), best[0])
    if len(names) > 1:
        raise InputError(
            f"{len(names)} topics with joint states: {', '.join(names)}",
            file=path,
            allowed=f"one {best[0].message.kind}",
            remedy=save_mapping(f"topic: {names[0]}"),
        )
    return best[0]


def _preferred(candidates: Sequence[_Topic]) -> list[_Topic]:
    for message in MESSAGES:
        same = [candidate for candidate in candidates if candidate.message is message]
        if same:
            return same
    return []


def _topic(name: str, message: JointMessage, seen: Sequence[JointValues], joints: Sequence[str] | None) -> _Topic:
    """Says what a topic calls the robot's joints: in one of its messages, or in several that share them."""
    named = list(dict.fromkeys(tuple(values.names) for values in seen))
    found = tuple(dict.fromkeys(joint for names in named for joint in names))
    called: tuple[str, ...] | None = None
    if not found:
        count = max(len(values.position) for values in seen)
        called = () if joints is None or len(joints) == count else None
    elif joints is None:
        called = next(names for names in named if names)
    else:
        order_in = ((names, places(names, joints)) for names in (*named, found))
        called = next((tuple(names[k] for k in order) for names, order in order_in if order is not None), None)
    has_effort = any(len(values.effort) and (not called or set(called) & set(values.names)) for values in seen)
    return _Topic(name=name, message=message, found=found, called=called, has_effort=bool(has_effort))


@lru_cache(maxsize=64)
def _places(found: tuple[str, ...], called: tuple[str, ...]) -> list[int | None] | None:
    """Where each joint stands in a message; None if the message is of other joints, such as a gripper's."""
    order = [found.index(name) if name in found else None for name in called]
    return None if order.count(None) == len(order) else order


def _table(
    path: Path, topic: _Topic, messages: Sequence[tuple[float, JointValues]], joints: Sequence[str] | None
) -> Table:
    """Makes a row of each message; what a message lacks is NaN in its row."""
    names = list(joints) if joints is not None else list(topic.called or ())
    rows: dict[str, list[list[float]]] = {"q": [], "dq": [], "tau": [], "qref": []}
    times: list[tuple[float, float]] = []
    for row, (received, values) in enumerate(messages, start=1):
        _check(path, row, values, names)
        if len(values.names):
            order = _places(tuple(values.names), topic.called or ())
        else:
            order = None if topic.called else list(range(len(values.position)))
        if not order:
            continue
        times.append((received, values.stamp or 0.0))
        width = len(values.names) or len(values.position)
        signals = (values.position, values.velocity, values.effort, values.command)
        for prefix, signal in zip(rows, signals, strict=True):
            if len(signal) not in (0, width):
                raise InputError(f"{len(signal)} values for {width} joints", file=path, column=prefix, row=row)
            rows[prefix].append([float(signal[k]) if k is not None and len(signal) else np.nan for k in order])
    if not times:
        raise _other_joints(path, topic, names)
    received, stamps = np.array(times).T
    # Messages of one publisher are stamped, or none is. A single one without a stamp has the time 0.
    columns: dict[str, Column] = {"t": stamps if 2 * np.count_nonzero(stamps) >= len(stamps) else received}
    for prefix, found in rows.items():
        matrix = np.array(found)
        if not np.isnan(matrix).all():
            columns.update({f"{prefix}{joint + 1}": matrix[:, joint].copy() for joint in range(matrix.shape[1])})
    source = TorqueSource(
        format=f"{topic.message.kind} of {topic.name}",
        columns=topic.message.field,
        quantity=topic.message.quantity,
        measured=topic.message.measured,
        meaning=topic.message.meaning,
    )
    metadata: dict[str, Any] = {"joints": names}
    if "tau1" in columns:
        metadata["torque_source"] = source.to_dict()
    else:
        metadata[NO_TORQUE] = f"the messages of {topic.name} carry no effort; record a topic that does"
    return Table(columns=columns, metadata=metadata, path=path, first_row=1)


def _other_joints(path: Path, topic: _Topic, names: Sequence[str]) -> InputError:
    """Returns the error of a topic without the robot's joints, with the mapping that would fit if there is one."""
    found = topic.found
    remedy = "list `joints` in a mapping (--mapping), in the robot's order"
    if found and len(found) < len(names):
        remedy = f"record {', '.join(name for name in names if name not in found)}, too, or choose the robot"
    elif len(found) == len(names):
        remedy = save_mapping(f"joints: [{', '.join(found)}]")
    return InputError(
        f"no message has the joints {', '.join(names)}",
        file=path,
        allowed=f"names in the messages: {', '.join(found) or 'none'}",
        remedy=remedy,
    )


def _check(path: Path, row: int, values: JointValues, wanted: Sequence[str] | None) -> None:
    found, count = list(values.names), len(values.position)
    if not found:
        if wanted and count and len(wanted) != count:
            raise InputError(f"{count} joints without names", file=path, row=row, allowed=f"{len(wanted)}")
    elif count and len(found) != count:
        raise InputError(f"{len(found)} names for {count} positions", file=path, row=row)
    elif len(set(found)) < len(found):
        raise InputError(f"a joint name appears twice: {', '.join(found)}", file=path, row=row)

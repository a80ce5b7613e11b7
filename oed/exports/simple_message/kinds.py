"""The numbers of the protocol: message types, communication types, replies, special sequences, valid fields."""

from __future__ import annotations

from enum import IntEnum, IntFlag
from typing import Literal

PointType = Literal["full", "short"]
"""Messages with a point: JOINT_TRAJ_PT_FULL or JOINT_TRAJ_PT."""

MESSAGE_JOINTS = 10
"""Reals in every array of joints; the unused ones are zero."""

LARGEST_MESSAGE = 1024
"""A frame is shorter than this [bytes]."""

PREFIX_BYTES, HEADER_BYTES = 4, 12
"""Bytes of the length field, and of the three fields behind it."""

MOTION_PORT, STATE_PORT = 11000, 11002
"""Usual ports: points go to the first, feedback comes from the second."""


class Kind(IntEnum):
    """Message types. 2001 and 2002 are Motoman's; `TORQUE_FEEDBACK` is ours, far above the types that are in use."""

    PING = 1
    JOINT_POSITION = 10
    JOINT_TRAJ_PT = 11
    STATUS = 13
    JOINT_TRAJ_PT_FULL = 14
    JOINT_FEEDBACK = 15
    MOTION_CONTROL = 2001
    MOTION_REPLY = 2002
    TORQUE_FEEDBACK = 9015


class Comm(IntEnum):
    """Communication types: a topic and a reply are not answered, a request is."""

    TOPIC = 1
    REQUEST = 2
    REPLY = 3


class Reply(IntEnum):
    """Reply codes; INVALID in everything that is no reply."""

    INVALID = 0
    SUCCESS = 1
    FAILURE = 2


class Special(IntEnum):
    """Sequence numbers of trajectory points that are commands."""

    START_DOWNLOAD = -1
    START_STREAMING = -2
    END = -3
    STOP = -4


class Command(IntEnum):
    """Commands of `MotionControl`."""

    CHECK_READY = 200101
    STOP = 200111
    START = 200121


class Result(IntEnum):
    """What became of a message, in `MotionReply`. A controller that is ready says SUCCESS, too."""

    SUCCESS = 0
    BUSY = 1
    FAILURE = 2
    INVALID = 3
    ALARM = 4
    NOT_READY = 5
    MOTION_FAILURE = 6


class Valid(IntFlag):
    """Fields that are filled; TORQUE and CURRENT name what the last array of `TORQUE_FEEDBACK` holds."""

    NONE = 0
    TIME = 1
    POSITION = 2
    VELOCITY = 4
    ACCELERATION = 8
    TORQUE = 16
    CURRENT = 32


MANUAL, AUTO = 1, 2
"""Operating modes of a status message; -1 is unknown."""

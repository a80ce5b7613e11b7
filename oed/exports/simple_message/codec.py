"""Messages to bytes and back: byte order and size of the reals are those of the controller."""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from math import isfinite
from typing import Any, Literal

from oed.exports.simple_message.errors import MessageError
from oed.exports.simple_message.kinds import (
    HEADER_BYTES,
    LARGEST_MESSAGE,
    MESSAGE_JOINTS,
    PREFIX_BYTES,
    Comm,
    Kind,
    Reply,
    Valid,
)
from oed.exports.simple_message.messages import (
    Bare,
    Frame,
    FullPoint,
    JointFeedback,
    JointPosition,
    Message,
    MotionControl,
    MotionReply,
    Ping,
    Point,
    Reals,
    Status,
    TorqueFeedback,
)
from robots.common.errors import InputError

# Bodies: i is an integer, r a real, j an array of ten reals.
_BODIES: dict[int, str] = {
    Kind.PING: "",
    Kind.JOINT_POSITION: "ij",
    Kind.JOINT_TRAJ_PT: "ijrr",
    Kind.STATUS: "iiiiiii",
    Kind.JOINT_TRAJ_PT_FULL: "iiirjjj",
    Kind.JOINT_FEEDBACK: "iirjjj",
    Kind.TORQUE_FEEDBACK: "iirjjjj",
    Kind.MOTION_CONTROL: "iiij",
    Kind.MOTION_REPLY: "iiiiij",
}
_BUILD: dict[int, Callable[..., Message]] = {
    Kind.PING: Ping,
    Kind.JOINT_POSITION: lambda sequence, q: JointPosition(sequence=sequence, positions=q),
    Kind.JOINT_TRAJ_PT: lambda sequence, q, velocity, duration: Point(
        sequence=sequence, positions=q, velocity=velocity, duration=duration
    ),
    Kind.STATUS: lambda powered, stopped, code, error, motion, mode, possible: Status(
        drives_powered=powered,
        e_stopped=stopped,
        error_code=code,
        in_error=error,
        in_motion=motion,
        mode=mode,
        motion_possible=possible,
    ),
    Kind.JOINT_TRAJ_PT_FULL: lambda robot, sequence, valid, time, q, dq, ddq: FullPoint(
        robot_id=robot,
        sequence=sequence,
        valid=Valid(valid & 63),
        time=time,
        positions=q,
        velocities=dq,
        accelerations=ddq,
    ),
    Kind.JOINT_FEEDBACK: lambda robot, valid, time, q, dq, ddq: JointFeedback(
        robot_id=robot, valid=Valid(valid & 63), time=time, positions=q, velocities=dq, accelerations=ddq
    ),
    Kind.TORQUE_FEEDBACK: lambda robot, valid, time, q, dq, ddq, efforts: TorqueFeedback(
        robot_id=robot,
        valid=Valid(valid & 63),
        time=time,
        positions=q,
        velocities=dq,
        accelerations=ddq,
        efforts=efforts,
    ),
    Kind.MOTION_CONTROL: lambda robot, sequence, command, data: MotionControl(
        robot_id=robot, sequence=sequence, command=command, data=data
    ),
    Kind.MOTION_REPLY: lambda robot, sequence, command, result, subcode, data: MotionReply(
        robot_id=robot, sequence=sequence, command=command, result=result, subcode=subcode, data=data
    ),
}


@dataclass(frozen=True, kw_only=True)
class WireFormat:
    """How a controller writes numbers.

    Attributes:
        byte_order: little on PCs; some controllers are big.
        real_bytes: 4 or 8.
    """

    byte_order: Literal["little", "big"] = "little"
    real_bytes: int = 4

    def __post_init__(self) -> None:
        """Checks the settings.

        Raises:
            InputError: another byte order or size.
        """
        if self.byte_order not in ("little", "big"):
            raise InputError(f"byte order {self.byte_order!r}", allowed="little or big")
        if self.real_bytes not in (4, 8):
            raise InputError(f"reals of {self.real_bytes} bytes", allowed="4 or 8")

    def encode(self, frame: Frame) -> bytes:
        """Writes a message with its header.

        Raises:
            MessageError: more than ten joints, a number that is not finite or too large, or reply codes that do not
                fit the communication type.
        """
        message = frame.message
        if (frame.comm == Comm.REPLY) != (frame.reply != Reply.INVALID):
            raise MessageError(f"{frame.comm.name} with the reply code {frame.reply.name}")
        if isinstance(message, Bare):
            return self._layout("").pack(HEADER_BYTES, message.kind, frame.comm, frame.reply)
        numbers: list[float] = []
        for value in _fields(message):
            if isinstance(value, tuple):
                if len(value) > MESSAGE_JOINTS:
                    raise MessageError(f"{len(value)} joints", allowed=f"up to {MESSAGE_JOINTS}")
                numbers += value
                numbers += (0.0,) * (MESSAGE_JOINTS - len(value))
            else:
                numbers.append(value)
        layout = self._layout(_BODIES[message.kind])
        if not all(map(isfinite, numbers)):
            raise MessageError("a number that is not finite", allowed="finite numbers")
        try:
            return layout.pack(layout.size - PREFIX_BYTES, message.kind, frame.comm, frame.reply, *numbers)
        except (struct.error, OverflowError) as error:
            raise MessageError(f"a number does not fit into its field ({error})") from error

    def decode(self, data: bytes) -> Frame:
        """Reads one message with its header.

        Raises:
            MessageError: anything else than exactly one message of a known type.
        """
        size = len(data)
        if not PREFIX_BYTES + HEADER_BYTES <= size < LARGEST_MESSAGE:
            raise MessageError(
                f"{size} bytes are no message", allowed=f"{PREFIX_BYTES + HEADER_BYTES} to {LARGEST_MESSAGE - 1} bytes"
            )
        length, kind, comm, reply = self._layout("").unpack_from(data)
        if length + PREFIX_BYTES != size:
            raise MessageError(
                f"the length field says {length}, the message has {size - PREFIX_BYTES} bytes", remedy=self._hint(data)
            )
        if kind not in _BODIES:
            raise MessageError(f"message type {kind}", allowed=", ".join(str(int(known)) for known in _BODIES))
        if not 1 <= comm <= 3 or not 0 <= reply <= 2 or (comm == Comm.REPLY) != (reply != Reply.INVALID):
            raise MessageError(f"communication type {comm} with reply code {reply}")
        if size == PREFIX_BYTES + HEADER_BYTES and kind != Kind.PING:
            if comm != Comm.REPLY:
                raise MessageError(f"a message of type {kind} without a body")
            return Frame(Bare(kind=kind), Comm(comm), Reply(reply))
        body = _BODIES[kind]
        layout = self._layout(body)
        if layout.size != size:
            raise MessageError(
                f"a message of type {kind} with {size} bytes", allowed=f"{layout.size} bytes", remedy=self._hint(data)
            )
        values = layout.unpack(data)[4:]
        if not all(map(isfinite, values)):
            raise MessageError(f"a message of type {kind} holds a number that is not finite")
        return Frame(_BUILD[kind](*_grouped(body, values)), Comm(comm), Reply(reply))

    def _layout(self, body: str) -> struct.Struct:
        return _struct(self.byte_order, self.real_bytes, body)

    def _hint(self, data: bytes) -> str | None:
        """Names the format in which the bytes would make sense."""
        for order in ("little", "big"):
            for size in (4, 8):
                length, kind = struct.unpack_from("<ii" if order == "little" else ">ii", data)
                layout = _struct(order, size, _BODIES.get(kind, ""))
                if length + PREFIX_BYTES == len(data) == layout.size and kind in _BODIES:
                    return f"the sender uses {order} byte order and reals of {size} bytes: set both so"
        return None


DEFAULT = WireFormat()
"""Little-endian with reals of 4 bytes."""


@lru_cache(maxsize=64)
def _struct(byte_order: str, real_bytes: int, body: str) -> struct.Struct:
    real = "f" if real_bytes == 4 else "d"
    text = body.replace("r", real).replace("j", f"{MESSAGE_JOINTS}{real}")
    return struct.Struct(("<" if byte_order == "little" else ">") + "4i" + text)


def _fields(message: Message) -> tuple[Any, ...]:
    return tuple(getattr(message, name) for name in message.__slots__)


def _grouped(body: str, values: tuple[Any, ...]) -> list[int | float | Reals]:
    """Puts ten reals of an array together."""
    grouped: list[int | float | Reals] = []
    at = 0
    for mark in body:
        if mark == "j":
            grouped.append(values[at : at + MESSAGE_JOINTS])
            at += MESSAGE_JOINTS
        else:
            grouped.append(values[at])
            at += 1
    return grouped


def shortest(value: float) -> float:
    """Gives the shortest decimal that a real of 4 bytes stands for: 99.996 and not 99.99600219726562."""
    import numpy as np

    return float(str(np.float32(value)))

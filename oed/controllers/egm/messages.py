"""Messages of ABB's Externally Guided Motion, as far as joints are concerned: client and test controller share them.

They are Protocol Buffers. Source: egm.proto of RobotWare (ros-industrial/abb_libegm, proto/egm.proto).
"""

from __future__ import annotations

import struct
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

from oed.controllers.rtde.feedback import StateFeedback
from oed.exports.simple_message import Frame, MessageError, Status, Valid
from robots.joints.controller_axes import ControllerAxes, axes_of, joints_of

DATA_MESSAGE, CORRECTION_MESSAGE = 2, 3
"""Kinds of messages: of the robot, and of who guides it."""

MOTORS_ON, MOTORS_OFF = 1, 2
GUIDING_STOPPED, GUIDING_RUNNING = 2, 3
"""States of the motion that is guided."""

_VARINT, _FIXED_64, _LENGTH_DELIMITED, _FIXED_32 = 0, 1, 2, 5


def _varint(value: int) -> bytes:
    out = bytearray()
    while value > 0x7F:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    return bytes([*out, value])


def _number(tag: int, value: int) -> bytes:
    return _varint(tag << 3 | _VARINT) + _varint(value)


def _block(tag: int, content: bytes) -> bytes:
    return _varint(tag << 3 | _LENGTH_DELIMITED) + _varint(len(content)) + content


def _joints(values: Sequence[float]) -> bytes:
    return b"".join(bytes([1 << 3 | _FIXED_64]) + struct.pack("<d", value) for value in values)


def _fields(data: bytes) -> Iterator[tuple[int, int | float | bytes]]:
    """Gives the number and the value of each field.

    Raises:
        MessageError: bytes that are no fields.
    """
    at = 0

    def varint() -> int:
        nonlocal at
        value = shift = 0
        while True:
            byte = data[at]
            at += 1
            value |= (byte & 0x7F) << shift
            shift += 7
            if byte < 0x80:
                return value
            if shift > 63:
                raise MessageError("a number that does not end")

    try:
        while at < len(data):
            key = varint()
            tag, kind = key >> 3, key & 7
            if kind == _VARINT:
                yield tag, varint()
            elif kind == _FIXED_64:
                yield tag, struct.unpack_from("<d", data, at)[0]
                at += 8
            elif kind == _FIXED_32:
                yield tag, struct.unpack_from("<f", data, at)[0]
                at += 4
            elif kind == _LENGTH_DELIMITED:
                size = varint()
                if at + size > len(data):
                    raise MessageError("a field that is cut")
                yield tag, data[at : at + size]
                at += size
            else:
                raise MessageError(f"a field of kind {kind}")
    except (IndexError, struct.error) as error:
        raise MessageError("a message that is cut") from error


def _within(data: bytes, *path: int) -> list[int | float | bytes]:
    """Gives the values of a field by the numbers on the way to it."""
    values: list[int | float | bytes] = [data]
    for tag in path:
        values = [
            value for part in values if isinstance(part, bytes) for number, value in _fields(part) if number == tag
        ]
    return values


def robot_message(
    number: int, time: float, axes: Sequence[float], motors: int = MOTORS_ON, guided: int = GUIDING_RUNNING
) -> bytes:
    """Makes what the controller sends in each cycle.

    Args:
        number: of the message.
        time: the controller's [s].
        axes: positions [deg].
        motors: whether they are on.
        guided: state of the guided motion.
    """
    header = _number(1, number) + _number(2, round(1e3 * time) & 0xFFFFFFFF) + _number(3, DATA_MESSAGE)
    seconds, micro = divmod(round(1e6 * time), 1_000_000)
    clock = _number(1, seconds) + _number(2, micro)
    return (
        _block(1, header)
        + _block(2, _block(1, _joints(axes)) + _block(4, clock))
        + _block(4, _number(1, motors))
        + _block(5, _number(1, guided))
    )


def guide_message(number: int, axes: Sequence[float]) -> bytes:
    """Makes the answer: where the axes shall be [deg]."""
    return _block(1, _number(1, number) + _number(3, CORRECTION_MESSAGE)) + _block(2, _block(1, _joints(axes)))


def guided_axes(data: bytes) -> list[float]:
    """Reads the axes of an answer [deg].

    Raises:
        MessageError: another message.
    """
    if _within(data, 1, 3) != [CORRECTION_MESSAGE]:
        raise MessageError("a message that guides nothing")
    return [float(value) for value in _within(data, 2, 1, 1)]


@dataclass(frozen=True)
class EgmForm:
    """Decodes what a controller sends, where simple_message has a `WireFormat`.

    Attributes:
        axes: how the controller counts the joints; None for as the description does.
    """

    axes: ControllerAxes | None = field(default=None, compare=False)
    real_bytes: int = 8

    def decode(self, data: bytes) -> Frame:
        """Reads a message of the robot.

        Raises:
            MessageError: another message, or one without joints or clock.
        """
        axes = _within(data, 2, 1, 1)
        clock = _within(data, 2, 4, 1) + _within(data, 2, 4, 2)
        if _within(data, 1, 3) != [DATA_MESSAGE] or not axes or len(clock) != 2:
            raise MessageError("a message without the robot's joints and clock")
        motors, guided = _within(data, 4, 1), _within(data, 5, 1)
        on, runs = motors == [MOTORS_ON], guided == [GUIDING_RUNNING]
        return Frame(
            StateFeedback(
                valid=Valid.TIME | Valid.POSITION,
                time=float(clock[0]) + 1e-6 * float(clock[1]),
                positions=tuple(joints_of(self.axes, axes).tolist()),
                velocities=(),
                accelerations=(),
                efforts=(),
                further={},
                played=0,
                status=Status(
                    drives_powered=int(on),
                    e_stopped=-1,
                    error_code=0,
                    in_error=0,
                    in_motion=-1,
                    mode=-1,
                    motion_possible=int(on and runs),
                ),
            )
        )

    def encode(self, frame: Frame) -> bytes:
        """Nothing is answered but by who guides."""
        return b""

    def guide(self, number: int, q: Sequence[float]) -> bytes:
        """Makes the answer that guides the robot to joint positions (n,) [rad]."""
        return guide_message(number, axes_of(self.axes, q).tolist())

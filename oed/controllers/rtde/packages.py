"""Packages of UR's Real-Time Data Exchange (RTDE), protocol version 2: client and test controller share them.

Source: the RTDE guide of Universal Robots, and its client library (RTDE_Python_Client_Library, rtde/rtde.py and
rtde/serialize.py).
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from enum import IntEnum

from oed.exports.simple_message import MessageError

RTDE_VERSION = 2

UR_JOINTS = 6

PLAYED = "output_int_register_24"
"""Register in which our program counts its points; those from 24 on are for clients like this one."""

FIELDS = {
    "timestamp": "DOUBLE",
    "actual_q": "VECTOR6D",
    "actual_qd": "VECTOR6D",
    "actual_current": "VECTOR6D",
    "target_moment": "VECTOR6D",
    "joint_temperatures": "VECTOR6D",
    "robot_mode": "INT32",
    "safety_mode": "INT32",
    "runtime_state": "UINT32",
    PLAYED: "INT32",
}
"""What is recorded, with its type."""

AS_TORQUE = "actual_current_as_torque"
"""Motor currents as joint torques [N m]; newer controllers have it."""

FORMATS = {"DOUBLE": "d", "VECTOR6D": "6d", "INT32": "i", "UINT32": "I"}
NOT_FOUND = "NOT_FOUND"


class Command(IntEnum):
    """Type of a package."""

    VERSION = ord("V")
    CONTROLLER_VERSION = ord("v")
    TEXT = ord("M")
    DATA = ord("U")
    OUTPUTS = ord("O")
    START = ord("S")


def package(command: Command, body: bytes = b"") -> bytes:
    """Makes a package: its size, its type, and what it says."""
    return struct.pack(">HB", 3 + len(body), command) + body


def opened(data: bytes) -> tuple[int, bytes]:
    """Gives type and body of a whole package."""
    return data[2], data[3:]


def body_format(types: Sequence[str]) -> struct.Struct:
    """Gives the format of a data package's body: the number of its recipe, then its fields.

    Raises:
        MessageError: an unknown type.
    """
    unknown = [name for name in types if name not in FORMATS]
    if unknown:
        raise MessageError(f"a field of type {unknown[0]!r}")
    return struct.Struct(">B" + "".join(FORMATS[name] for name in types))


class Packages:
    """Cuts a stream of bytes into packages."""

    MOST = 4096
    """No package of this protocol is larger [bytes]."""

    def __init__(self) -> None:
        self._held = b""

    def feed(self, data: bytes) -> list[bytes]:
        """Takes bytes as they come, and gives the packages that are whole.

        Raises:
            MessageError: a size that no package has.
        """
        self._held += data
        found = []
        while len(self._held) >= 3:
            (size,) = struct.unpack_from(">H", self._held)
            if not 3 <= size <= self.MOST:
                raise MessageError(f"a package of {size} bytes")
            if len(self._held) < size:
                break
            found.append(self._held[:size])
            self._held = self._held[size:]
        return found

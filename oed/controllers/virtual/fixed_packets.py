"""Packets of a fixed size, as Fanuc's relay reads them: their type and length field do not matter."""

from __future__ import annotations

import struct
from math import isfinite

from oed.exports.simple_message import Comm, Frame, Kind, MessageError, Point, WireFormat

SHORT_PACKET, LONG_PACKET = 60, 68
"""Bytes of JOINT_POSITION and JOINT_TRAJ_PT."""


class FixedPackets:
    """Cuts a stream into packets, and reads each as a point.

    Args:
        form: byte order of the numbers; reals have 4 bytes.
    """

    def __init__(self, form: WireFormat) -> None:
        self._order = "<" if form.byte_order == "little" else ">"
        self._held = bytearray()

    def feed(self, data: bytes) -> list[bytes]:
        """Adds bytes and returns the packets that are whole now."""
        self._held += data
        packets = []
        while len(self._held) >= SHORT_PACKET:
            length, kind = struct.unpack_from(f"{self._order}2i", self._held)
            size = LONG_PACKET if kind == Kind.JOINT_TRAJ_PT and length >= LONG_PACKET - 4 else SHORT_PACKET
            if len(self._held) < size:
                break
            packets.append(bytes(self._held[:size]))
            del self._held[:size]
        return packets

    def point(self, packet: bytes) -> Frame:
        """Reads a packet as a point that wants a reply.

        Raises:
            MessageError: a position that is no number.
        """
        (sequence,) = struct.unpack_from(f"{self._order}i", packet, 16)
        positions = struct.unpack_from(f"{self._order}10f", packet, 20)
        velocity, duration = (
            struct.unpack_from(f"{self._order}2f", packet, 60) if len(packet) == LONG_PACKET else (0.0, 0.0)
        )
        if not all(map(isfinite, (*positions, velocity, duration))):
            raise MessageError("a position that is no number")
        return Frame(Point(sequence=sequence, positions=positions, velocity=velocity, duration=duration), Comm.REQUEST)

"""A byte stream cut into frames: TCP keeps the order of bytes, not the borders of messages."""

from __future__ import annotations

import struct

from oed.exports.simple_message.codec import WireFormat
from oed.exports.simple_message.errors import MessageError
from oed.exports.simple_message.kinds import HEADER_BYTES, LARGEST_MESSAGE, PREFIX_BYTES


class Splitter:
    """Collects bytes and gives whole frames.

    Args:
        form: how the other side writes numbers.
    """

    def __init__(self, form: WireFormat) -> None:
        self._length = struct.Struct("<i" if form.byte_order == "little" else ">i")
        self._order = form.byte_order
        self._held = bytearray()

    def feed(self, data: bytes) -> list[bytes]:
        """Adds bytes and returns the frames that are whole now, each with its length field.

        Raises:
            MessageError: an impossible length. Where the next frame begins is unknown then: close the connection.
        """
        self._held += data
        frames = []
        while len(self._held) >= PREFIX_BYTES:
            (length,) = self._length.unpack_from(self._held)
            if not HEADER_BYTES <= length < LARGEST_MESSAGE - PREFIX_BYTES:
                raise MessageError(
                    f"a length field of {length}",
                    allowed=f"{HEADER_BYTES} to {LARGEST_MESSAGE - PREFIX_BYTES - 1}",
                    remedy=f"the other side speaks another protocol, or its byte order is not {self._order}",
                )
            if len(self._held) < length + PREFIX_BYTES:
                break
            frames.append(bytes(self._held[: length + PREFIX_BYTES]))
            del self._held[: length + PREFIX_BYTES]
        return frames

"""The one error of bytes that are no message."""

from __future__ import annotations

from robots.common.errors import OedError


class MessageError(OedError):
    """Bytes that are no message of the protocol, whatever is wrong with them."""

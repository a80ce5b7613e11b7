"""What a link to a controller does."""

from __future__ import annotations

from abc import ABC, abstractmethod


class Link(ABC):
    """One connection to one port of a controller.

    Attributes:
        place: host, port and transport, for messages.
        reliable: whether what is sent arrives once and in order.
    """

    place: str
    reliable: bool

    @abstractmethod
    def send(self, data: bytes) -> None:
        """Sends one frame.

        Raises:
            LinkError: the connection is gone.
        """

    @abstractmethod
    def receive(self, timeout: float) -> bytes | None:
        """Waits for bytes that may be one frame; None if there are none within the time [s].

        Raises:
            LinkError: the connection is gone.
            MessageError: a stream of another protocol.
        """

    @abstractmethod
    def close(self) -> None:
        """Closes the link; more than once does no harm."""

    def __enter__(self) -> Link:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

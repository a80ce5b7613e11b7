"""A link by TCP: the controller is the server and takes one client."""

from __future__ import annotations

import select
import socket
import time
from collections import deque
from typing import Protocol

from oed.controllers.errors import LinkError
from oed.controllers.links.base import Link
from oed.controllers.links.udp import unknown_host
from oed.controllers.options import Endpoint
from oed.exports.simple_message import Splitter


class StreamSplitter(Protocol):
    """Cuts a stream of bytes into messages."""

    def feed(self, data: bytes) -> list[bytes]:
        """Takes bytes as they come, and gives the messages that are whole."""
        ...


class TcpLink(Link):
    """See `Link`.

    Args:
        endpoint: the controller.
        port: which of its ports.
        splitter: cuts the stream into messages; into those of simple_message by default.
    """

    reliable = True

    def __init__(self, endpoint: Endpoint, port: int, splitter: StreamSplitter | None = None) -> None:
        self.place = endpoint.place(port)
        self._splitter = splitter or Splitter(endpoint.wire_form)
        self._frames: deque[bytes] = deque()
        self._patience = endpoint.connect_time
        try:
            self._socket = socket.create_connection((endpoint.host, port), timeout=endpoint.connect_time)
        except (socket.gaierror, UnicodeError) as error:
            raise unknown_host(endpoint.host) from error
        except ConnectionRefusedError as error:
            raise LinkError(
                f"nothing listens at {self.place}",
                remedy="check host and port, and that the driver program runs on the controller",
            ) from error
        except OSError as error:
            reason = "no answer" if isinstance(error, TimeoutError) else error.strerror
            raise LinkError(f"{self.place} cannot be reached ({reason})", remedy="check the host") from error
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def send(self, data: bytes) -> None:
        """Sends one frame; see `Link.send`."""
        try:
            self._socket.settimeout(self._patience)
            self._socket.sendall(data)
        except TimeoutError as error:
            raise LinkError(f"{self.place} takes no more data for {self._patience:g} s") from error
        except OSError as error:
            raise self._closed() from error

    def receive(self, timeout: float) -> bytes | None:
        """Waits for a frame; see `Link.receive`."""
        end = time.monotonic() + timeout
        while not self._frames:
            left = end - time.monotonic()
            try:
                if not select.select([self._socket], [], [], max(left, 0.0))[0]:
                    return None
                data = self._socket.recv(65536)
            except (OSError, ValueError) as error:
                raise self._closed() from error
            if not data:
                raise self._closed()
            self._frames += self._splitter.feed(data)
        return self._frames.popleft()

    def _closed(self) -> LinkError:
        return LinkError(
            f"{self.place} closed the connection",
            remedy="another client may be connected, or the controller's program ended",
        )

    def close(self) -> None:
        """Closes the connection."""
        self._socket.close()

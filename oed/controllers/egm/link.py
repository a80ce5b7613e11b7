"""The link to a controller that is guided: its state in each cycle, and the next position as the answer."""

from __future__ import annotations

import select
import socket
import time
from collections.abc import Callable

from oed.controllers.errors import LinkError
from oed.controllers.links.base import Link
from oed.controllers.links.udp import unknown_host
from oed.controllers.options import Endpoint
from robots.common.errors import InputError

Answer = Callable[[bytes], bytes | None]


class EgmLink(Link):
    """Listens at a port of this computer; without `answer` nothing is ever sent.

    Attributes:
        answer: gives what is sent back to a message, or None.

    Args:
        endpoint: the controller; datagrams of other addresses are left out.
        port: of this computer, as the controller's device of transmission states it.

    Raises:
        InputError: a host without address, or a port that is taken.
    """

    reliable = False

    def __init__(self, endpoint: Endpoint, port: int) -> None:
        self.place = f"{endpoint.host} at port {port} of this computer (EGM)"
        try:
            self._host = socket.gethostbyname(endpoint.host)
        except (OSError, UnicodeError) as error:
            raise unknown_host(endpoint.host) from error
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            self._socket.bind(("", port))
        except OSError as error:
            self._socket.close()
            raise InputError(
                f"cannot listen at port {port} ({(error.strerror or str(error)).lower()})",
                remedy="end the program that uses it, or state another --state-port here and at the controller",
            ) from error
        self.answer: Answer | None = None

    def send(self, data: bytes) -> None:
        """Nothing is sent but answers."""

    def receive(self, timeout: float) -> bytes | None:
        """Waits for a message, and answers it at once; see `Link.receive`."""
        end = time.monotonic() + timeout
        while True:
            try:
                if not select.select([self._socket], [], [], max(end - time.monotonic(), 0.0))[0]:
                    return None
                data, sender = self._socket.recvfrom(4096)
                if sender[0] != self._host:
                    continue
                reply = None if self.answer is None else self.answer(data)
                if reply is not None:
                    self._socket.sendto(reply, sender)
                return data
            except (OSError, ValueError) as error:
                raise LinkError(f"{self.place} is closed") from error

    def close(self) -> None:
        """Closes the port."""
        self._socket.close()

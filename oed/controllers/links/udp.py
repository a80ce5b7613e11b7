"""A link by UDP: one frame a datagram, opened by a handshake of one byte."""

from __future__ import annotations

import select
import socket
import time

from oed.controllers.errors import LinkError, ProtocolError
from oed.controllers.links.base import Link
from oed.controllers.options import Endpoint
from oed.exports.simple_message import MessageError, WireFormat
from robots.common.errors import InputError


class UdpLink(Link):
    """See `Link`. Bytes of later handshakes are skipped; datagrams of others never arrive.

    Args:
        endpoint: the controller.
        port: which of its ports.
    """

    reliable = False

    def __init__(self, endpoint: Endpoint, port: int) -> None:
        self.place = endpoint.place(port)
        self._byte = bytes([endpoint.handshake])
        self._first: bytes | None = None
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            # Bytes of feedback that the system may hold while we are busy.
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 2**22)
            self._socket.setblocking(False)
            if endpoint.one_address:
                # A link that keeps its address comes from one of so many ports, below those of the system.
                self._bind(20_000 + port % 10_000)
            try:
                # `connect` alone has no clear error for a name that cannot be encoded.
                found = socket.getaddrinfo(endpoint.host, port, socket.AF_INET, socket.SOCK_DGRAM)
                self._socket.connect(found[0][4])
            except (socket.gaierror, UnicodeError) as error:
                raise unknown_host(endpoint.host) from error
            except OSError as error:
                raise LinkError(f"{self.place} cannot be reached ({error.strerror})") from error
            self._shake_hands(endpoint)
        except BaseException:
            self._socket.close()
            raise

    def _bind(self, local: int) -> None:
        try:
            self._socket.bind(("", local))
        except OSError as error:
            raise LinkError(
                f"port {local} of this computer is taken ({(error.strerror or str(error)).lower()})",
                remedy="end the other program; the controller sends to this port only",
            ) from error

    def _shake_hands(self, endpoint: Endpoint) -> None:
        end = time.monotonic() + endpoint.connect_time
        refused = other = False
        while time.monotonic() < end:
            refused = not self._try_send(self._byte) or refused
            stop = min(end, time.monotonic() + endpoint.handshake_interval)
            while (left := stop - time.monotonic()) > 0:
                data = self._wait(left)
                if data == self._byte:
                    return
                if data and self._is_message(endpoint.wire_form, data):
                    # A server that answers one handshake only goes on with what it does.
                    self._first = data
                    return
                if data == b"":
                    refused = True
                    break
                other = other or data is not None
            if refused:
                time.sleep(min(0.05, max(0.0, end - time.monotonic())))
        if refused and not other:
            raise LinkError(
                f"nothing listens at {self.place}",
                remedy="check host and port, and that the driver program runs on the controller",
            )
        raise (ProtocolError if other else LinkError)(
            f"{self.place} does not answer the handshake 0x{endpoint.handshake:02X} within {endpoint.connect_time:g} s",
            remedy=(
                "check the host; another client may be connected; old controllers use the handshake 0xFF"
                + ("; what answered is no simple_message controller" if other else "")
            ),
        )

    @staticmethod
    def _is_message(form: WireFormat, data: bytes) -> bool:
        try:
            form.decode(data)
        except MessageError:
            return False
        return True

    def _try_send(self, data: bytes) -> bool:
        try:
            self._socket.send(data)
        except ConnectionRefusedError:
            return False
        except BlockingIOError:
            select.select([], [self._socket], [], 0.1)
        except OSError as error:
            raise LinkError(f"{self.place} cannot be reached ({error.strerror})") from error
        return True

    def _wait(self, timeout: float) -> bytes | None:
        """Waits for a datagram; empty where the other side refuses."""
        for attempt in (True, False):
            try:
                return self._socket.recv(4096) or b"\0"
            except BlockingIOError:
                if not attempt or not select.select([self._socket], [], [], max(timeout, 0.0))[0]:
                    return None
            except ConnectionRefusedError:
                return b""
            except OSError as error:
                raise LinkError(f"{self.place} cannot be reached ({error.strerror})") from error
        return None

    def send(self, data: bytes) -> None:
        """Sends one datagram; one that is refused counts as lost."""
        self._try_send(data)

    def receive(self, timeout: float) -> bytes | None:
        """Waits for a datagram; see `Link.receive`. Refusals are left to the time-outs of who waits."""
        end = time.monotonic() + timeout
        if self._first is not None:
            first, self._first = self._first, None
            return first
        while True:
            data = self._wait(end - time.monotonic())
            if data is None:
                return None
            if data == b"":
                time.sleep(min(0.01, max(0.0, end - time.monotonic())))
            elif data != self._byte:
                return data
            if time.monotonic() >= end:
                return None

    def close(self) -> None:
        """Closes the socket."""
        self._socket.close()


def unknown_host(host: str) -> InputError:
    """Gives the error of a host without address."""
    return InputError(f"the host {host!r} has no address", remedy="check the name, or give the IP address")

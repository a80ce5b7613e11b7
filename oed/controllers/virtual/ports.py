"""The controller's side of the network: ports that give who sent what, by UDP and by TCP."""

from __future__ import annotations

import math
import socket
from abc import ABC, abstractmethod
from collections.abc import Callable, Hashable
from contextlib import suppress

from oed.controllers.links.tcp import StreamSplitter
from oed.exports.simple_message import MessageError
from robots.common.errors import InputError

Client = Hashable
Received = list[tuple[Client, bytes]]

BUFFERED_BYTES = 2**22


class Port(ABC):
    """One port with its clients.

    Attributes:
        number: of the port.
        clients: those connected, with the time [s] at which each was last heard.
    """

    number: int

    def __init__(self, most: int) -> None:
        self.clients: dict[Client, float] = {}
        self._most = most

    @abstractmethod
    def sockets(self) -> list[socket.socket]:
        """Lists the sockets to wait for."""

    @abstractmethod
    def receive(self, ready: socket.socket, now: float) -> Received:
        """Takes what has arrived at a socket; it never blocks."""

    @abstractmethod
    def admit(self, client: Client, data: bytes, now: float) -> bytes | None:
        """Looks at bytes before they are decoded.

        Returns:
            An answer that opens the link, or None.
        """

    @abstractmethod
    def send(self, client: Client, data: bytes) -> None:
        """Sends bytes; a client that is gone is forgotten."""

    def release(self, client: Client) -> None:
        """Lets another client take the place of one that has finished."""
        if client in self.clients:
            self.clients[client] = -math.inf

    def drop(self, client: Client) -> None:
        """Ends the link of a client."""
        self.clients.pop(client, None)

    @abstractmethod
    def forget(self) -> None:
        """Ends all links."""

    @abstractmethod
    def close(self) -> None:
        """Ends all links and stops to listen."""


class UdpPort(Port):
    """A port by UDP.

    Args:
        host: address to listen at.
        number: of the port; 0 for a free one.
        handshake: the byte that opens a link.
        most: clients at once; a further one waits until one is silent, or takes its place where `take_over`.
        once: whether only the first handshake is answered as one.
        stale: what its client gets for a later one; None for nothing.
    """

    def __init__(self, host: str, number: int, handshake: int, most: int, once: bool, stale: bytes | None) -> None:
        super().__init__(most)
        self._socket = listening(host, number, socket.SOCK_DGRAM)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, BUFFERED_BYTES)
        self._byte = bytes([handshake])
        self._once, self._stale = once, stale
        self.number = self._socket.getsockname()[1]

    def sockets(self) -> list[socket.socket]:
        """Lists the one socket."""
        return [self._socket]

    def receive(self, ready: socket.socket, now: float) -> Received:
        """Takes the datagrams that have arrived."""
        found: Received = []
        # Datagrams that are taken from the system at once.
        while len(found) < 256:
            try:
                data, client = self._socket.recvfrom(4096)
            except ConnectionError:
                continue
            except OSError:
                break
            found.append((client, data))
        return found

    def admit(self, client: Client, data: bytes, now: float) -> bytes | None:
        """Answers a handshake if there is room for the client."""
        if data == self._byte and not (self._once and self.clients):
            if client not in self.clients and len(self.clients) >= self._most:
                oldest = min(self.clients, key=lambda known: self.clients[known])
                # A client that was not heard for so long [s] may be replaced by UDP, which reports no disconnection.
                if now - self.clients[oldest] < 5.0:
                    return None
                del self.clients[oldest]
            self.clients[client] = now
            return data
        if client in self.clients:
            self.clients[client] = now
        return self._stale if data == self._byte and client in self.clients else None

    def send(self, client: Client, data: bytes) -> None:
        """Sends one datagram; a full buffer of the system loses it."""
        with suppress(OSError):
            self._socket.sendto(data, client)  # type: ignore[call-overload]

    def forget(self) -> None:
        """Forgets all clients."""
        self.clients.clear()

    def close(self) -> None:
        """Closes the socket."""
        self._socket.close()


class TcpPort(Port):
    """A port by TCP; clients beyond the number are disconnected at once.

    Args:
        host: address to listen at.
        number: of the port; 0 for a free one.
        splitter: makes what cuts the bytes of a client into frames.
        most: clients at once.
    """

    def __init__(self, host: str, number: int, splitter: Callable[[], StreamSplitter], most: int) -> None:
        super().__init__(most)
        self._listener = listening(host, number, socket.SOCK_STREAM)
        self._listener.listen(8)
        self._splitter = splitter
        self._open: dict[Client, tuple[socket.socket, StreamSplitter]] = {}
        self._unsent: dict[Client, bytearray] = {}
        self.number = self._listener.getsockname()[1]

    def sockets(self) -> list[socket.socket]:
        """Lists the listener and all connections."""
        return [self._listener, *(connection for connection, _ in self._open.values())]

    def receive(self, ready: socket.socket, now: float) -> Received:
        """Accepts a client, or takes whole frames from one."""
        if ready is self._listener:
            with suppress(OSError):
                connection, client = self._listener.accept()
                if len(self._open) >= self._most:
                    connection.close()
                    return []
                connection.setblocking(False)
                connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                self._open[client] = (connection, self._splitter())
                self._unsent[client] = bytearray()
                self.clients[client] = now
            return []
        client = next((key for key, (connection, _) in self._open.items() if connection is ready), None)
        if client is None:
            return []
        try:
            data = ready.recv(65536)
            if data:
                self.clients[client] = now
                return [(client, frame) for frame in self._open[client][1].feed(data)]
        except BlockingIOError:
            return []
        except (OSError, MessageError):
            pass
        self.drop(client)
        return []

    def admit(self, client: Client, data: bytes, now: float) -> bytes | None:
        """Needs no handshake."""
        return None

    def send(self, client: Client, data: bytes) -> None:
        """Sends bytes; a client that takes none for long is disconnected."""
        if client not in self._open:
            return
        waiting = self._unsent[client]
        waiting += data
        try:
            sent = self._open[client][0].send(waiting)
            del waiting[:sent]
        except BlockingIOError:
            if len(waiting) > BUFFERED_BYTES:
                self.drop(client)
        except OSError:
            self.drop(client)

    def forget(self) -> None:
        """Disconnects all clients."""
        for client in list(self._open):
            self.drop(client)

    def drop(self, client: Client) -> None:
        """Disconnects a client."""
        self._open.pop(client)[0].close()
        self._unsent.pop(client)
        self.clients.pop(client, None)

    def close(self) -> None:
        """Disconnects all clients and closes the listener."""
        self.forget()
        self._listener.close()


def listening(host: str, number: int, kind: socket.SocketKind) -> socket.socket:
    """Binds a socket that never blocks.

    Raises:
        InputError: the port is taken, or the address is not of this computer.
    """
    bound = socket.socket(socket.AF_INET, kind)
    try:
        if kind == socket.SOCK_STREAM:
            bound.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        bound.bind((host, number))
    except OSError as error:
        bound.close()
        raise InputError(
            f"cannot listen at {host}:{number} ({(error.strerror or str(error)).lower()})",
            remedy="choose another port, or end the program that uses it",
        ) from error
    bound.setblocking(False)
    return bound

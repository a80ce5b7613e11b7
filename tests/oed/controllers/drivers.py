"""What vendors' drivers make of a stream of bytes, and a controller of raw sockets: no code of the product.

Sources: ``ipkt_checkfd`` and ``ipkt_dsrlse`` of Fanuc's driver (karel/libind_pkt.kl), its ``ros_relay.kl``,
and the framing of ROS-Industrial's library (simple_message, ``SmplMsgConnection::receiveMsg``).
"""

from __future__ import annotations

import select
import socket
import struct
import threading
import time
from contextlib import suppress

Point = tuple[float, ...]

JOINT_POSITION, JOINT_TRAJ_PT, STATUS, JOINT_TRAJ_PT_FULL = 10, 11, 13, 14
TOPIC, REQUEST = 1, 2


class FanucReader:
    """Fanuc's relay: it takes 60 or 68 bytes at a time, and looks neither at the type nor at the length before.

    Args:
        order: ``>`` for the big-endian numbers of its controllers, ``<`` for little-endian ones.
    """

    def __init__(self, order: str) -> None:
        self._order, self._held = order, b""
        self.points: list[Point] = []
        self.stops = 0

    def feed(self, data: bytes) -> None:
        """Take bytes as they come from the socket."""
        self._held += data
        while len(self._held) >= 60:
            length, kind, _, _, sequence = struct.unpack_from(self._order + "5i", self._held)
            joints = struct.unpack_from(self._order + "10f", self._held, 20)
            size = 68 if kind == JOINT_TRAJ_PT and length >= 64 else 60
            if len(self._held) < size:
                return
            self._held = self._held[size:]
            if sequence >= 0:
                self.points.append(joints)
            self.stops += sequence == -4


class FramedReader:
    """ROS-Industrial's reader: the length field says where a message ends, its type what it is."""

    def __init__(self, order: str) -> None:
        self._order, self._held = order, b""
        self.points: list[Point] = []

    def feed(self, data: bytes) -> None:
        """Take bytes as they come from the socket."""
        self._held += data
        while len(self._held) >= 4:
            (length,) = struct.unpack_from(self._order + "i", self._held)
            if not 0 < length < 4096 or len(self._held) < 4 + length:
                return
            frame, self._held = self._held[4 : 4 + length], self._held[4 + length :]
            if len(frame) < 12:
                continue
            (kind,) = struct.unpack_from(self._order + "i", frame)
            where = {JOINT_POSITION: 12, JOINT_TRAJ_PT: 12, JOINT_TRAJ_PT_FULL: 16}.get(kind)
            if where is not None and len(frame) >= where + 44:
                (sequence,) = struct.unpack_from(self._order + "i", frame, where)
                if sequence >= 0:
                    at = where + 4 if kind != JOINT_TRAJ_PT_FULL else where + 12
                    self.points.append(struct.unpack_from(self._order + "10f", frame, at))


def points_seen(data: bytes) -> list[Point]:
    """Everything that a known reader takes for a joint point, in either byte order."""
    found: list[Point] = []
    for order in "<>":
        for reader in (FanucReader(order), FramedReader(order)):
            reader.feed(data)
            found += reader.points
    return found


class Tap:
    """A controller of raw sockets whose robot stands at zero: it reports that, and keeps every byte that it is sent.

    Args:
        transport: udp or tcp.
        order: of its numbers.
        comm: feedback as topics, or as requests that want an answer.
        e_stopped: whether its emergency stop is pressed.
    """

    def __init__(self, transport: str, order: str = "<", comm: int = TOPIC, e_stopped: bool = False) -> None:
        self._kind = socket.SOCK_STREAM if transport == "tcp" else socket.SOCK_DGRAM
        position = struct.pack(f"{order}5i10f", 56, JOINT_POSITION, comm, 0, 0, *[0.0] * 10)
        status = struct.pack(f"{order}11i", 40, STATUS, TOPIC, 0, 1, int(e_stopped), 0, 0, 0, 2, int(not e_stopped))
        self._feedback = [position, status]
        self.motion, self.state = b"", b""
        self.connections = 0
        self._motion, self._state = self._bound(), self._bound()
        self.motion_port, self.state_port = (sock.getsockname()[1] for sock in (self._motion, self._state))
        self._end = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)

    def _bound(self) -> socket.socket:
        sock = socket.socket(socket.AF_INET, self._kind)
        sock.bind(("127.0.0.1", 0))
        if self._kind == socket.SOCK_STREAM:
            sock.listen()
        return sock

    def __enter__(self) -> Tap:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._end.set()
        self._thread.join()
        for sock in (self._motion, self._state):
            sock.close()

    def _run(self) -> None:
        listeners: dict[socket.socket, str] = {self._motion: "motion", self._state: "state"}
        open_: dict[socket.socket, str] = {}
        clients: list[tuple[socket.socket, object]] = []
        due = 0.0
        while not self._end.is_set():
            for sock in select.select([*listeners, *open_], [], [], 0.005)[0]:
                name = listeners.get(sock) or open_[sock]
                if sock in listeners and self._kind == socket.SOCK_STREAM:
                    connection, _ = sock.accept()
                    open_[connection] = name
                    self.connections += name == "motion"
                    if name == "state":
                        clients.append((connection, None))
                    continue
                try:
                    data, client = sock.recvfrom(65536)
                except OSError:
                    data, client = b"", None
                setattr(self, name, getattr(self, name) + data)
                if sock in open_ and not data:
                    del open_[sock]
                    clients = [known for known in clients if known[0] is not sock]
                    sock.close()
                elif self._kind == socket.SOCK_DGRAM and len(data) == 1:
                    sock.sendto(data, client)
                    self.connections += name == "motion"
                    if name == "state":
                        clients.append((sock, client))
            if time.monotonic() > due:
                due = time.monotonic() + 0.02
                for sock, client in clients:
                    for frame in self._feedback:
                        with suppress(OSError):
                            sock.sendall(frame) if client is None else sock.sendto(frame, client)
        for sock in open_:
            sock.close()

"""A UR controller of raw sockets: no code of the product. It keeps what it is sent.

Source of the packages: the RTDE guide of Universal Robots (protocol version 2).
"""

from __future__ import annotations

import socket
import struct
import threading
import time
from contextlib import suppress

FORMATS = {"DOUBLE": "d", "VECTOR6D": "6d", "INT32": "i", "UINT32": "I"}
TYPES = {"timestamp": "DOUBLE", "robot_mode": "INT32", "safety_mode": "INT32", "runtime_state": "UINT32"}
SILENT, TEXT = "silent", "text"


class RtdeTap:
    """Serves one client of RTDE with a robot at rest, and listens at a port for programs.

    Args:
        pose: where the robot stands.
        missing: fields that it does not know.
        version: of the controller.
        safety_mode: that it reports.
        manner: ``silent`` answers nothing, ``text`` sends a text message between its answers.
    """

    def __init__(
        self,
        pose: list[float],
        missing: tuple[str, ...] = (),
        version: tuple[int, int] = (5, 12),
        safety_mode: int = 1,
        manner: str = TEXT,
    ) -> None:
        self._pose, self._missing, self._version, self._manner = pose, missing, version, manner
        self._safety_mode = safety_mode
        self.commands: list[str] = []
        self.frequencies: list[float] = []
        self.programs = b""
        self._end = threading.Event()
        self._servers = [socket.create_server(("127.0.0.1", 0)) for _ in range(2)]
        self.state_port, self.motion_port = (server.getsockname()[1] for server in self._servers)
        self.connections = 0
        self._threads = [threading.Thread(target=target, daemon=True) for target in (self._serve, self._listen)]

    def __enter__(self) -> RtdeTap:
        for thread in self._threads:
            thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._end.set()
        for server in self._servers:
            with suppress(OSError):
                server.shutdown(socket.SHUT_RDWR)
            server.close()
        for thread in self._threads:
            thread.join()

    def _listen(self) -> None:
        with suppress(OSError):
            connection, _ = self._servers[1].accept()
            self.connections += 1
            connection.settimeout(0.05)
            with connection:
                while not self._end.is_set():
                    with suppress(TimeoutError):
                        self.programs += connection.recv(65536)

    def _serve(self) -> None:
        with suppress(OSError):
            connection, _ = self._servers[0].accept()
            with connection:
                self._answer(connection)

    def _answer(self, connection: socket.socket) -> None:
        connection.settimeout(0.004)
        held, names, begun = b"", [], 0.0
        while not self._end.is_set():
            try:
                data = connection.recv(65536)
                if not data:
                    return
                held += data
            except TimeoutError:
                pass
            while len(held) >= 3 and len(held) >= struct.unpack_from(">H", held)[0]:
                (size,) = struct.unpack_from(">H", held)
                command, body, held = chr(held[2]), held[3:size], held[size:]
                self.commands.append(command)
                if self._manner == SILENT:
                    continue
                if self._manner == TEXT:
                    connection.sendall(struct.pack(">HB", 3 + 6, ord("M")) + b"\2hi\1s\3")
                if command == "V":
                    reply = struct.pack(">B", struct.unpack(">H", body) == (2,))
                elif command == "v":
                    reply = struct.pack(">4I", *self._version, 0, 0)
                elif command == "O":
                    self.frequencies.append(struct.unpack_from(">d", body)[0])
                    names = body[8:].decode().split(",")
                    reply = b"\1" + ",".join(map(self._type, names)).encode()
                else:
                    reply, begun = b"\1", time.monotonic()
                connection.sendall(struct.pack(">HB", 3 + len(reply), ord(command)) + reply)
            if begun:
                values: list[float] = []
                for name in names:
                    values += self._value(name, time.monotonic() - begun)
                form = ">B" + "".join(FORMATS[self._type(name)] for name in names)
                body = struct.pack(form, 1, *values)
                connection.sendall(struct.pack(">HB", 3 + len(body), ord("U")) + body)

    def _type(self, name: str) -> str:
        if name in self._missing:
            return "NOT_FOUND"
        return TYPES.get(name, "INT32" if name.startswith("output_int") else "VECTOR6D")

    def _value(self, name: str, elapsed: float) -> list[float]:
        fixed = {"timestamp": [elapsed], "robot_mode": [7], "safety_mode": [self._safety_mode], "runtime_state": [1]}
        if name in fixed:
            return fixed[name]
        if self._type(name) == "INT32":
            return [0]
        index = ["actual_q", "actual_qd", "actual_current", "target_moment", "joint_temperatures"].index(name)
        return self._pose if not index else [10.0 * index + joint for joint in range(6)]

"""Links to a UR controller: its RTDE interface, which is only listened to, and its port for programs."""

from __future__ import annotations

import struct
import time
from math import nan

from oed.controllers.errors import ControllerError, ProtocolError
from oed.controllers.links.tcp import TcpLink
from oed.controllers.options import Endpoint
from oed.controllers.rtde.packages import (
    AS_TORQUE,
    FIELDS,
    NOT_FOUND,
    RTDE_VERSION,
    UR_JOINTS,
    Command,
    Packages,
    body_format,
    opened,
    package,
)
from oed.exports.simple_message import MessageError

CYCLES = {3: 0.008}
"""Cycle of CB controllers by the first number of their version [s]."""


class RtdeLink(TcpLink):
    """Subscribes to the state of a UR controller; inputs are never set up, so nothing that it sends can move a robot.

    Attributes:
        cycle: time of a control cycle [s].

    Args:
        endpoint: the controller.
        port: of RTDE, 30004.

    Raises:
        InputError: a host that has no address.
        LinkError: the connection is refused.
        ProtocolError: no RTDE interface of this version, or none of the fields.
    """

    def __init__(self, endpoint: Endpoint, port: int) -> None:
        super().__init__(endpoint, port, Packages())
        try:
            self._subscribe(time.monotonic() + endpoint.connect_time)
        except MessageError as error:
            self.close()
            raise ProtocolError(f"{self.place} speaks another protocol than RTDE: {error}") from error
        except BaseException:
            self.close()
            raise

    def _subscribe(self, end: float) -> None:
        if self._asked(Command.VERSION, struct.pack(">H", RTDE_VERSION), end) != b"\1":
            raise ProtocolError(f"{self.place} has no RTDE of version {RTDE_VERSION}", remedy="update the controller")
        major, minor, *_ = struct.unpack_from(">4I", self._asked(Command.CONTROLLER_VERSION, b"", end).ljust(16, b"\0"))
        # Cycle of the e-series and later ones [s].
        self.cycle = CYCLES.get(major, 0.002)
        names = [*FIELDS, AS_TORQUE]
        reply = self._asked(Command.OUTPUTS, struct.pack(">d", 1 / self.cycle) + ",".join(names).encode(), end)
        types = reply[1:].decode("ascii", "replace").split(",")
        if AS_TORQUE in names and len(types) == len(names) and types[-1] == NOT_FOUND:
            names.pop()
            reply = self._asked(Command.OUTPUTS, struct.pack(">d", 1 / self.cycle) + ",".join(names).encode(), end)
            types = reply[1:].decode("ascii", "replace").split(",")
        wrong = [name for name, kind in zip(names, types, strict=False) if kind == NOT_FOUND]
        if wrong or len(types) != len(names):
            raise ProtocolError(
                f"{self.place} has no {wrong[0] if wrong else 'fields of RTDE'} (version {major}.{minor})",
                remedy="update the controller: registers from 24 on came with versions 3.9 and 5.3",
            )
        self._size = body_format(types).size
        self._torques = b"" if names[-1] == AS_TORQUE else struct.pack(f">{UR_JOINTS}d", *[nan] * UR_JOINTS)
        if self._asked(Command.START, b"", end) != b"\1":
            raise ControllerError(f"{self.place} does not start to send", remedy="restart the controller")

    def _asked(self, command: Command, body: bytes, end: float) -> bytes:
        """Gives the body of the reply to a request."""
        self.send(package(command, body))
        while (left := end - time.monotonic()) > 0:
            data = super().receive(left)
            if data is not None and opened(data)[0] == command:
                return opened(data)[1]
        raise ProtocolError(
            f"{self.place} does not answer as an RTDE interface does", remedy="check --state-port: it is 30004"
        )

    def receive(self, timeout: float) -> bytes | None:
        """Waits for the next state; torques that the controller has not are NaN."""
        end = time.monotonic() + timeout
        while (data := super().receive(max(end - time.monotonic(), 0.0))) is not None:
            kind, body = opened(data)
            if kind == Command.DATA:
                if len(body) != self._size:
                    raise MessageError(f"a data package of {len(data)} bytes")
                return data + self._torques
        return None

    @property
    def own_address(self) -> str:
        """Address of this computer, as the controller sees it."""
        return str(self._socket.getsockname()[0])


class _Unread:
    """What the port for programs says is read and left out: a port whose words nobody reads drops its client."""

    def feed(self, data: bytes) -> list[bytes]:
        return []


class ScriptLink(TcpLink):
    """The port that takes programs, 30002.

    Args:
        endpoint: the controller.
        port: its number.
    """

    def __init__(self, endpoint: Endpoint, port: int) -> None:
        super().__init__(endpoint, port, _Unread())

    def run(self, program: str) -> None:
        """Sends a program; it takes the place of one that runs.

        Raises:
            LinkError: the connection is gone.
        """
        self.send(program.encode("ascii"))

    def drain(self) -> None:
        """Reads what has arrived.

        Raises:
            LinkError: the connection is gone.
        """
        self.receive(0.0)

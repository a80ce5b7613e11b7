"""Where a controller listens, and what a link to it does."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, Literal

from oed.controllers.drivers import Driver
from oed.controllers.drivers.base import Protocol
from oed.controllers.egm.messages import EgmForm
from oed.controllers.rtde.state import RtdeForm
from oed.exports.simple_message import DEFAULT, WireFormat
from oed.exports.simple_message.kinds import MOTION_PORT, STATE_PORT
from robots.common.errors import InputError

HANDSHAKE = 0x8E
"""The one byte that opens a link by UDP; 0xFF in old versions."""

FORMS: dict[str, type[RtdeForm | EgmForm]] = {"rtde": RtdeForm, "egm": EgmForm}
"""Forms of the messages of protocols that have one only."""


@dataclass(frozen=True, kw_only=True)
class Endpoint:
    """A controller and how it is spoken to.

    Attributes:
        host: name or address.
        protocol: ``simple_message``, ``rtde`` of UR, or ``egm`` of ABB.
        transport: udp or tcp.
        motion_port: takes points.
        state_port: gives feedback.
        form: byte order and reals.
        handshake: the byte that opens a link by UDP.
        connect_time: how long to try [s].
        handshake_interval: between two handshakes [s].
        one_address: by UDP, whether links come from one port of this computer each time, as a server needs that answers
            the first handshake only.
    """

    host: str
    protocol: Protocol = "simple_message"
    transport: Literal["udp", "tcp"] = "udp"
    motion_port: int = MOTION_PORT
    state_port: int = STATE_PORT
    form: WireFormat | RtdeForm | EgmForm = DEFAULT
    handshake: int = HANDSHAKE
    connect_time: float = 5.0
    handshake_interval: float = 1.0
    one_address: bool = False

    @classmethod
    def of(cls, driver: Driver, host: str, **changes: Any) -> Endpoint:
        """Makes the endpoint of a driver.

        Args:
            driver: its profile.
            host: name or address of the controller.
            changes: other settings.

        Raises:
            InputError: see `Endpoint`.
        """
        usual = {
            "protocol": driver.protocol,
            "transport": driver.transport,
            "motion_port": driver.motion_port,
            "state_port": driver.state_port,
            "form": FORMS[driver.protocol]() if driver.protocol in FORMS else WireFormat(byte_order=driver.byte_order),
            "one_address": driver.one_handshake,
        }
        return cls(host=host, **(usual | changes))

    def __post_init__(self) -> None:
        """Checks the settings.

        Raises:
            InputError: no host, another transport, a port or byte out of range, or a time that is not positive.
        """
        if not self.host.strip():
            raise InputError("the host is empty", allowed="the name or the IP address of the controller")
        if self.transport not in ("udp", "tcp"):
            raise InputError(f"transport {self.transport!r}", allowed="udp or tcp")
        for name in ("motion_port", "state_port"):
            if not 0 < getattr(self, name) < 65536:
                raise InputError(f"{name} {getattr(self, name)}", allowed="1 to 65535")
        if not isinstance(self.form, FORMS.get(self.protocol, WireFormat)):
            raise InputError(
                f"a byte order or size of reals for {self.protocol}, whose messages have one form",
                remedy="leave out --byte-order and --real-bytes",
            )
        if not 0 <= self.handshake < 256:
            raise InputError(f"handshake {self.handshake}", allowed="one byte, 0 to 255")
        if not (self.connect_time > 0 and self.handshake_interval > 0):
            raise InputError("a time to connect that is not positive", allowed="seconds above zero")

    @property
    def wire_form(self) -> WireFormat:
        """Form of the messages of simple_message.

        Raises:
            InputError: a controller of another protocol.
        """
        if not isinstance(self.form, WireFormat):
            raise InputError(f"{self.protocol} is no simple_message", remedy="correct --driver")
        return self.form

    def place(self, port: int) -> str:
        """Names a port for messages."""
        return f"{self.host}:{port} ({self.transport.upper()})"


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

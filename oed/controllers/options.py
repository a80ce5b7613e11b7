"""Where a controller listens, how it is spoken to, and how a trajectory is sent."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self

from oed.controllers.drivers import Driver, driver_of
from oed.controllers.drivers.base import PointType, Protocol
from oed.exports.simple_message.codec import WireFormat
from oed.exports.simple_message.kinds import MOTION_PORT, STATE_PORT
from robots.common.errors import InputError
from robots.common.options import Option, numbers

if TYPE_CHECKING:
    from oed.controllers.egm.messages import EgmForm
    from oed.controllers.rtde.state import RtdeForm

HANDSHAKE = 0x8E
"""The one byte that opens a link by UDP; 0xFF in old versions."""

BY_DRIVER: Any = None
"""Default of a setting that is the driver's; without a driver, the one that its class names."""

OF_STREAM = ("external_axes", "reply_time", "robot_id", "ignore_status")
"""Fields of `StreamOptions` that are options of a single stream only."""


def _driver(option: str, text: str) -> Driver:
    return driver_of(text)


def _byte(option: str, text: str) -> int:
    try:
        return int(text, 0)
    except ValueError:
        raise InputError(f"{option} {text}", allowed="one byte, such as 0x8E or 0xFF") from None


@dataclass(frozen=True, kw_only=True)
class DriverSettings:
    """Settings whose defaults are those of a driver's profile.

    Attributes:
        driver: program on the controller: efort, fanuc, motoman, abb, egm, ur or generic. Sets what is not stated.
    """

    driver: Annotated[Driver | None, Option(reads=_driver)] = None

    @classmethod
    def of(cls, driver: Driver, **changes: Any) -> Self:
        """Makes the settings of a driver.

        Args:
            driver: its profile.
            changes: other settings.

        Raises:
            InputError: see the class.
        """
        return cls(driver=driver, **changes)

    def settle(self, **usual: Any) -> None:
        """Sets what is not stated: as the driver has it, else as usual.

        Args:
            usual: the settings without a driver.
        """
        for name, value in usual.items():
            if getattr(self, name) is None:
                object.__setattr__(self, name, value if self.driver is None else getattr(self.driver, name, value))


@dataclass(frozen=True, kw_only=True)
class Wire(DriverSettings):
    """Ports of a controller, and how messages look there.

    Attributes:
        transport: ``udp`` or ``tcp``. Default: the driver's, else udp.
        motion_port: port that takes points. Default: the driver's, else 11000.
        state_port: port that gives feedback. Default: the driver's, else 11002.
        byte_order: byte order of the controller: little or big. Default: the driver's, else little.
        real_bytes: bytes of a real number: 4 or 8. Default: 4.
        handshake: byte that opens a link by UDP; 0xFF for old controllers.
    """

    transport: Literal["udp", "tcp"] = BY_DRIVER
    motion_port: int = BY_DRIVER
    state_port: int = BY_DRIVER
    byte_order: Literal["little", "big"] = BY_DRIVER
    real_bytes: int = BY_DRIVER
    handshake: Annotated[int, Option(reads=_byte, typed="0x8E")] = HANDSHAKE

    def check(self, least_port: int) -> None:
        """Settles and checks the settings.

        Args:
            least_port: the lowest port allowed.

        Raises:
            InputError: another transport or form of the messages, or a port or byte out of range.
        """
        self.settle(transport="udp", motion_port=MOTION_PORT, state_port=STATE_PORT)
        if self.transport not in ("udp", "tcp"):
            raise InputError(f"transport {self.transport!r}", allowed="udp or tcp")
        for name in ("motion_port", "state_port"):
            if not least_port <= getattr(self, name) < 65536:
                raise InputError(f"{name} {getattr(self, name)}", allowed=f"{least_port} to 65535")
        if not 0 <= self.handshake < 256:
            raise InputError(f"handshake {self.handshake}", allowed="one byte, 0 to 255")

    def simple_form(self) -> WireFormat:
        """Makes the form of the messages of simple_message.

        Raises:
            InputError: another byte order or size.
        """
        usual = "little" if self.driver is None else self.driver.byte_order
        return WireFormat(byte_order=self.byte_order or usual, real_bytes=self.real_bytes or 4)


@dataclass(frozen=True, kw_only=True)
class Endpoint(Wire):
    """A controller and how it is spoken to.

    Attributes:
        host: name or IP address of the robot controller.
        protocol: ``simple_message``, ``rtde`` of UR, or ``egm`` of ABB. Default: the driver's.
        connect_time: how long to try [s].
        handshake_interval: between two handshakes [s].
        one_address: by UDP, whether links come from one port of this computer each time, as a server needs that answers
            the first handshake only. Default: as the driver needs it.

    Raises:
        InputError: no host, another transport or form, a port or byte out of range, or a time that is not positive.
    """

    host: str
    protocol: Annotated[Protocol, Option(hidden=True)] = BY_DRIVER
    connect_time: Annotated[float, Option(hidden=True)] = 5.0
    handshake_interval: Annotated[float, Option(hidden=True)] = 1.0
    one_address: Annotated[bool, Option(hidden=True)] = BY_DRIVER

    @classmethod
    def of(cls, driver: Driver, host: str = "", **changes: Any) -> Self:
        """Makes the endpoint of a driver.

        Args:
            driver: its profile.
            host: name or address of the controller.
            changes: other settings.

        Raises:
            InputError: see `Endpoint`.
        """
        return cls(driver=driver, host=host, **changes)

    def __post_init__(self) -> None:
        if not self.host.strip():
            raise InputError("the host is empty", allowed="the name or the IP address of the controller")
        self.check(least_port=1)
        one_address = self.driver is not None and self.driver.one_handshake
        self.settle(protocol="simple_message", one_address=one_address)
        if self.protocol != "simple_message" and (self.byte_order, self.real_bytes) != (None, None):
            raise InputError(
                f"a byte order or size of reals for {self.protocol}, whose messages have one form",
                remedy="leave out --byte-order and --real-bytes",
            )
        self.simple_form()
        if not (self.connect_time > 0 and self.handshake_interval > 0):
            raise InputError("a time to connect that is not positive", allowed="seconds above zero")

    @cached_property
    def form(self) -> WireFormat | RtdeForm | EgmForm:
        """Form of the messages."""
        if self.protocol == "rtde":
            from oed.controllers.rtde.state import RtdeForm

            return RtdeForm()
        if self.protocol == "egm":
            from oed.controllers.egm.messages import EgmForm

            return EgmForm()
        return self.simple_form()

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


@dataclass(frozen=True, kw_only=True)
class StreamOptions(DriverSettings):
    """How a trajectory is sent.

    Attributes:
        points: ``full``: JOINT_TRAJ_PT_FULL, short: JOINT_TRAJ_PT. Default: the driver's, else full.
        download: send all points at once, without replies; the robot starts afterwards.
        window: points on their way at once, if the controller's replies repeat the point.
        patience: longest silence of the controller before giving up [s].
        start_tolerance: farthest pose from the first point [rad or m].
        tolerance: farthest feedback from the plan [rad or m], for all joints or each, or inf. Default: 0.05 rad, 0.02
            m.
        ping: ping the motion port. Some drivers, as Fanuc's, read pings as points and move.
        timed: whether the controller plays in time. Otherwise only the path is watched. Default: the driver's.
        speed: how many times faster than real time the controller to test against plays [1].
        external_axes: the controller has axes behind those of the robot: they stay where they are.
        reply_time: UDP: send a point again after so long without a reply [s].
        robot_id: number of the robot at its controller.
        ignore_status: start in spite of a reported error, e-stop or manual mode.
        download_rate: points a second of a download by UDP.

    Raises:
        InputError: an unknown type of points, a number out of range, or what a driver misreads.
    """

    points: PointType = BY_DRIVER
    download: bool = BY_DRIVER
    window: int = 1
    patience: float = 2.0
    start_tolerance: float = 0.01
    tolerance: Annotated[float | tuple[float, ...] | None, Option(reads=numbers)] = None
    ping: Annotated[bool, Option(switch=True)] = False
    timed: Annotated[bool, Option(hidden=True)] = BY_DRIVER
    speed: float = 1.0
    external_axes: bool = False
    reply_time: float = 0.1
    robot_id: int = 0
    ignore_status: bool = False
    download_rate: Annotated[float, Option(hidden=True)] = 2000.0

    def __post_init__(self) -> None:
        import numpy as np

        self.settle(points="full", download=False, timed=True)
        driver = self.driver
        if driver is not None and self.ping and driver.pings != "answered":
            does = {"point": "takes pings for points", "end": "ends at a ping", "unknown": "knows no pings"}
            raise InputError(f"{driver.title} {does[driver.pings]}", remedy="leave out --ping")
        if driver is not None and driver.points != self.points and driver.one_form:
            raise InputError(
                f"{driver.title} misreads points of type {self.points}",
                allowed=f"{driver.points}",
                remedy="leave out --points",
            )
        if self.points not in ("full", "short"):
            raise InputError(f"points of type {self.points!r}", allowed="full or short")
        if not 1 <= self.window <= 64:
            raise InputError(f"a window of {self.window} points", allowed="1 to 64")
        if not 0 < self.reply_time <= self.patience <= 3600:
            raise InputError(
                f"a reply time of {self.reply_time} s and a patience of {self.patience} s",
                allowed="above 0, the reply time not above the patience",
            )
        if not 0 < self.start_tolerance < float("inf"):
            raise InputError(f"a start tolerance of {self.start_tolerance}", allowed="above 0 [rad or m]")
        if self.tolerance is not None and not np.greater(self.tolerance, 0).all():
            raise InputError(f"a tolerance of {self.tolerance}", allowed="above 0 [rad or m]")
        if not self.speed > 0:
            raise InputError(f"a speed of {self.speed}", allowed="above 0")
        if not self.download_rate > 0:
            raise InputError(f"a download rate of {self.download_rate}", allowed="above 0 points a second")

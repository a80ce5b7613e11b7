"""Settings of the controller to test against, and the faults that it can have."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any, Literal, get_args

from oed.controllers.drivers import Driver
from oed.controllers.drivers.base import Replies
from oed.controllers.links.base import HANDSHAKE
from oed.controllers.virtual.faults.paths import KINDS
from oed.controllers.virtual.faults.paths import Kind as PathKind
from oed.exports.simple_message import DEFAULT, WireFormat
from oed.exports.simple_message.kinds import MOTION_PORT, STATE_PORT
from robots.common.errors import InputError


@dataclass(frozen=True, kw_only=True)
class Faults:
    """What goes wrong. Shares are of the datagrams of both ports, both ways, and are for UDP.

    Attributes:
        lose: share that is lost.
        double: share that arrives twice.
        late: share that arrives late.
        late_by: by so much [s].
        reorder: share that the next one overtakes.
        silent_after: points after which nothing more is sent; None for never.
        error_after: points after which the controller reports an error.
        e_stop_after: points after which an emergency stop is pressed.
        restart_after: points after which the controller restarts and forgets everything.
        stuck: no point is ever played, so the buffer never empties.
        path: what the robot does with its path, see `PathFault`. The torque stays that of the path.
        path_after: so long after the start of a trajectory [s].
        seed: of the faults.
    """

    lose: float = 0.0
    double: float = 0.0
    late: float = 0.0
    late_by: float = 0.05
    reorder: float = 0.0
    silent_after: int | None = None
    error_after: int | None = None
    e_stop_after: int | None = None
    restart_after: int | None = None
    stuck: bool = False
    path: PathKind = "none"
    path_after: float = 0.0
    seed: int = 0

    def __post_init__(self) -> None:
        """Checks the ranges.

        Raises:
            InputError: a share outside 0 to 1, a negative time or number, or an unknown fault of the path.
        """
        if self.path not in KINDS:
            raise InputError(f"a path fault {self.path!r}", allowed=", ".join(KINDS))
        if not self.path_after >= 0:
            raise InputError(f"path_after is {self.path_after}", allowed="0 s or more")
        for name in ("lose", "double", "late", "reorder"):
            if not 0 <= getattr(self, name) <= 1:
                raise InputError(f"{name} is {getattr(self, name)}", allowed="a share, 0 to 1")
        if not 0 <= self.late_by <= 60:
            raise InputError(f"late_by is {self.late_by}", allowed="0 to 60 s")
        for item in fields(self):
            value = getattr(self, item.name)
            if item.name.endswith("_after") and item.name != "path_after" and value is not None and value < 0:
                raise InputError(f"{item.name} is {value}", allowed="zero or more points")

    @property
    def of_datagrams(self) -> bool:
        """Whether any datagram is treated."""
        return max(self.lose, self.double, self.late, self.reorder) > 0


@dataclass(frozen=True, kw_only=True)
class ControllerOptions:
    """How the controller behaves.

    Attributes:
        driver: profile of the program that it stands for; None for what the other settings say.
        host: address to listen at.
        transport: udp or tcp.
        motion_port: takes points; 0 for any free one.
        state_port: gives feedback; 0 for any free one.
        form: byte order and reals.
        handshake: the byte that opens a link by UDP.
        capacity: points that the buffer holds.
        feedback: ``position`` is the thesis' message, ``full`` has time, velocity and acceleration, ``torque`` also
            torque (a type of our own); ``feedback`` has positions only, as Motoman's.
        feedback_period: between two feedback messages [s].
        feedback_every: of so many periods one message is sent.
        status: whether status messages are sent, ten a second.
        replies: see `Driver.replies`.
        speed: how many times faster than real time.
        wait_for_points: whether an empty buffer makes time stand still instead of being an error.
        state: ``ready``, or what keeps the controller from moving: ``error``, ``e-stop``, ``manual``, ``drives-off``.
        external: where axes stand that the controller has behind those of the robot [rad or m].
        start_tolerance: farthest first point from the pose [rad or m].
        faults: what goes wrong.
    """

    driver: Driver | None = None
    host: str = "127.0.0.1"
    transport: Literal["udp", "tcp"] = "udp"
    motion_port: int = MOTION_PORT
    state_port: int = STATE_PORT
    form: WireFormat = DEFAULT
    handshake: int = HANDSHAKE
    # Points that the thesis' controller holds.
    capacity: int = 100
    feedback: Literal["position", "feedback", "full", "torque"] = "torque"
    feedback_period: float = 0.004
    feedback_every: int = 1
    status: bool = True
    replies: Replies = "bare"
    speed: float = 1.0
    wait_for_points: bool = False
    state: Literal["ready", "error", "e-stop", "manual", "drives-off"] = "ready"
    external: tuple[float, ...] = ()
    start_tolerance: float = 0.05
    faults: Faults = Faults()

    @classmethod
    def of(cls, driver: Driver, **changes: Any) -> ControllerOptions:
        """Makes a controller that behaves as a driver does.

        Args:
            driver: its profile.
            changes: other settings.

        Raises:
            InputError: see `ControllerOptions`.
        """
        usual = {
            "transport": driver.transport,
            "motion_port": driver.motion_port,
            "state_port": driver.state_port,
            "form": WireFormat(byte_order=driver.byte_order),
            "capacity": driver.capacity,
            "feedback": driver.feedback,
            "feedback_every": max(round(driver.feedback_period / 0.004), 1),
            "replies": driver.replies,
        }
        return cls(driver=driver, **(usual | changes))

    def __post_init__(self) -> None:
        """Checks the settings.

        Raises:
            InputError: an unknown choice, or a number out of range.
        """
        choices = {
            "transport": ("udp", "tcp"),
            "feedback": ("position", "feedback", "full", "torque"),
            "replies": get_args(Replies),
            "state": ("ready", "error", "e-stop", "manual", "drives-off"),
        }
        for name, allowed in choices.items():
            if getattr(self, name) not in allowed:
                raise InputError(f"{name} {getattr(self, name)!r}", allowed=", ".join(allowed))
        for name in ("motion_port", "state_port"):
            if not 0 <= getattr(self, name) < 65536:
                raise InputError(f"{name} {getattr(self, name)}", allowed="0 to 65535")
        if not 0 <= self.handshake < 256:
            raise InputError(f"handshake {self.handshake}", allowed="one byte, 0 to 255")
        if not 2 <= self.capacity <= 1_000_000:
            raise InputError(f"a buffer of {self.capacity} points", allowed="2 to 1,000,000")
        if not 1e-4 <= self.feedback_period <= 10:
            raise InputError(f"a feedback period of {self.feedback_period} s", allowed="0.0001 to 10 s")
        if not 0 < self.speed <= 1000:
            raise InputError(f"a speed of {self.speed}", allowed="above 0, to 1000")
        if not self.start_tolerance > 0:
            raise InputError(f"a start tolerance of {self.start_tolerance}", allowed="above 0")

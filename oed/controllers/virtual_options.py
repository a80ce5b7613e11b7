"""Settings of the controller to test against, and the faults that it can have."""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property
from typing import Annotated, Literal, get_args

from oed.controllers.drivers.base import Replies
from oed.controllers.options import BY_DRIVER, Wire
from oed.exports.simple_message.codec import WireFormat
from robots.common.errors import InputError
from robots.common.options import Option, Seed

PathKind = Literal["none", "swap", "sign", "half-speed", "stall", "offset", "other-robot"]

FEEDBACK_PERIOD = 0.004
"""Between two messages of a controller that sends in each cycle [s]."""


@dataclass(frozen=True, kw_only=True)
class Faults:
    """What goes wrong. Shares are of the datagrams of both ports, both ways, and are for UDP.

    Attributes:
        lose: UDP: share of lost datagrams.
        double: UDP: share of doubled datagrams.
        late: UDP: share of late datagrams.
        late_by: delay of late datagrams [s].
        reorder: UDP: share of reordered datagrams.
        silent_after: fall silent after so many points.
        error_after: report an error after so many points.
        e_stop_after: emergency stop after so many points.
        restart_after: restart after so many points, with nothing remembered.
        stuck: play nothing, so that the buffer never empties.
        path: what the robot does wrong: none, swap, sign, half-speed, stall, offset or other-robot. The torque stays
            that of the path.
        path_after: begin with it so long after the start of a trajectory [s].
        seed: seed of the random numbers.

    Raises:
        InputError: a share outside 0 to 1, a negative time or number, or an unknown fault of the path.
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
    path: Annotated[PathKind, Option(name="path-fault")] = "none"
    path_after: Annotated[float, Option(name="path-fault-after")] = 0.0
    seed: Seed = 0

    def __post_init__(self) -> None:
        if self.path not in get_args(PathKind):
            raise InputError(f"a path fault {self.path!r}", allowed=", ".join(get_args(PathKind)))
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
class ControllerOptions(Wire):
    """How the controller behaves. Port 0 is any free one.

    Attributes:
        host: address to listen at.
        capacity: points that the buffer holds. Default: the driver's, else 100.
        feedback: ``position`` (JOINT_POSITION), full (JOINT_FEEDBACK), feedback (positions only, as Motoman's), or
            torque (with torque). Default: the driver's, else torque.
        feedback_period: time between two feedback messages [s].
        feedback_every: of so many periods one message is sent. Default: as the driver needs it.
        status: send status messages, ten a second.
        replies: ``bare``: without a body; echo: with the point they reply to; see `Driver`. Default: the driver's, else
            bare.
        state: reported state: ready, error, e-stop, manual or drives-off.
        speed: how many times faster than real time [1].
        wait_for_points: time stands still while the buffer is empty; otherwise an error.
        external: where axes stand that the controller has behind those of the robot [rad or m].
        start_tolerance: farthest first point from the pose [rad or m].
        faults: what goes wrong.

    Raises:
        InputError: an unknown choice, or a number out of range.
    """

    host: Annotated[str, Option(hidden=True)] = "127.0.0.1"
    capacity: int = BY_DRIVER
    feedback: Literal["position", "feedback", "full", "torque"] = BY_DRIVER
    feedback_period: float = FEEDBACK_PERIOD
    feedback_every: Annotated[int, Option(hidden=True)] = BY_DRIVER
    status: bool = True
    replies: Replies = BY_DRIVER
    state: Literal["ready", "error", "e-stop", "manual", "drives-off"] = "ready"
    speed: float = 1.0
    wait_for_points: bool = False
    external: Annotated[tuple[float, ...], Option(hidden=True)] = ()
    start_tolerance: Annotated[float, Option(hidden=True)] = 0.05
    faults: Faults = Faults()

    def __post_init__(self) -> None:
        self.check(least_port=0)
        every = 1 if self.driver is None else max(round(self.driver.feedback_period / FEEDBACK_PERIOD), 1)
        self.settle(capacity=100, feedback="torque", replies="bare", feedback_every=every)
        self.simple_form()
        choices = {
            "feedback": ("position", "feedback", "full", "torque"),
            "replies": get_args(Replies),
            "state": ("ready", "error", "e-stop", "manual", "drives-off"),
        }
        for name, allowed in choices.items():
            if getattr(self, name) not in allowed:
                raise InputError(f"{name} {getattr(self, name)!r}", allowed=", ".join(allowed))
        if not 2 <= self.capacity <= 1_000_000:
            raise InputError(f"a buffer of {self.capacity} points", allowed="2 to 1,000,000")
        if not 1e-4 <= self.feedback_period <= 10:
            raise InputError(f"a feedback period of {self.feedback_period} s", allowed="0.0001 to 10 s")
        if not 0 < self.speed <= 1000:
            raise InputError(f"a speed of {self.speed}", allowed="above 0, to 1000")
        if not self.start_tolerance > 0:
            raise InputError(f"a start tolerance of {self.start_tolerance}", allowed="above 0")

    @cached_property
    def form(self) -> WireFormat:
        """Form of the messages."""
        return self.simple_form()

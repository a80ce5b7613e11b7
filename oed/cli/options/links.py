"""Options of the way to a controller."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

from robots.common.errors import InputError
from robots.common.options import Numbers, Option

if TYPE_CHECKING:
    from oed.controllers import ControllerOptions, Endpoint, StreamOptions
    from oed.controllers.drivers import Driver


@dataclass(frozen=True, kw_only=True)
class StateLink:
    """How the feedback of a controller is heard.

    Attributes:
        driver: program on the controller: efort, fanuc, motoman, abb, egm, ur or generic. Sets what is not stated.
        transport: ``udp`` or ``tcp``. Default: the driver's, else udp.
        state_port: port that gives feedback. Default: the driver's, else 11002.
        byte_order: byte order of the controller: little or big. Default: the driver's, else little.
        real_bytes: bytes of a real number: 4 or 8. Default: 4.
        handshake: byte that opens a link by UDP; 0xFF for old controllers. Default: 0x8E.
    """

    driver: str | None = None
    transport: str | None = None
    state_port: int | None = None
    byte_order: str | None = None
    real_bytes: int | None = None
    handshake: str | None = None

    def profile(self) -> Driver | None:
        """Gives the profile of the driver; None without one.

        Raises:
            InputError: an unknown driver.
        """
        from oed.controllers.drivers import driver_of

        return None if self.driver is None else driver_of(self.driver)

    def endpoint(self, host: str) -> Endpoint:
        """Makes the endpoint.

        Args:
            host: name or address of the controller.

        Raises:
            InputError: an option out of range.
        """
        from oed.controllers import Endpoint

        driver, settings = self.profile(), self.settings()
        return Endpoint(host=host, **settings) if driver is None else Endpoint.of(driver, host, **settings)

    def settings(self) -> dict[str, Any]:
        """Gives the settings of a link that are stated.

        Raises:
            InputError: an option out of range.
        """
        from oed.exports.simple_message import WireFormat

        driver = self.profile()
        found = stated(self, "transport", "motion_port", "state_port")
        if self.byte_order is not None or self.real_bytes is not None:
            order: Any = self.byte_order or ("little" if driver is None else driver.byte_order)
            found["form"] = WireFormat(byte_order=order, real_bytes=self.real_bytes or 4)
        if self.handshake is not None:
            try:
                found["handshake"] = int(self.handshake, 0)
            except ValueError:
                allowed = "one byte, such as 0x8E or 0xFF"
                raise InputError(f"--handshake {self.handshake}", allowed=allowed) from None
        return found


@dataclass(frozen=True, kw_only=True)
class Link(StateLink):
    """How a controller is spoken to.

    Attributes:
        motion_port: port that takes points. Default: the driver's, else 11000.
    """

    motion_port: int | None = None


@dataclass(frozen=True, kw_only=True)
class Streaming:
    """How a trajectory is sent.

    Attributes:
        points: ``full``: JOINT_TRAJ_PT_FULL, short: JOINT_TRAJ_PT. Default: full.
        download: send all points at once, without replies; the robot starts afterwards.
        window: points on their way at once, if the controller's replies repeat the point.
        patience: longest silence of the controller before giving up [s].
        start_tolerance: farthest pose from the first point [rad or m].
        tolerance: farthest feedback from the plan [rad or m], for all joints or each, or inf. Default: 0.05 rad, 0.02
            m.
        ping: ping the motion port. Some drivers, as Fanuc's, read pings as points and move.
    """

    points: str | None = None
    download: bool = False
    window: int = 1
    patience: float = 2.0
    start_tolerance: float = 0.01
    tolerance: Numbers = None
    ping: Annotated[bool, Option(switch=True)] = False

    def options(self, link: Link, **settings: Any) -> StreamOptions:
        """Makes the settings of a stream.

        Args:
            link: whose driver sets what is not stated.
            settings: further ones.

        Raises:
            InputError: an option out of range, or one that a driver misreads.
        """
        from oed.controllers import StreamOptions

        shared = ("window", "patience", "start_tolerance", "tolerance", "ping")
        settings |= {name: getattr(self, name) for name in shared} | stated(self, "points")
        if self.download:
            settings["download"] = True
        driver = link.profile()
        return StreamOptions(**settings) if driver is None else StreamOptions.of(driver, **settings)


@dataclass(frozen=True, kw_only=True)
class TimedStreaming(Streaming):
    """How trajectories are sent to a controller to test against, too.

    Attributes:
        speed: how many times faster than real time the controller to test against plays.
    """

    speed: float = 1.0


@dataclass(frozen=True, kw_only=True)
class Behaviour:
    """How the controller to test against behaves.

    Attributes:
        capacity: points that the buffer holds. Default: 100.
        feedback: ``position`` (JOINT_POSITION), full (JOINT_FEEDBACK), or torque (with torque). Default: torque.
        feedback_period: time between two feedback messages [s]. Default: 0.004.
        status: send status messages, ten a second.
        replies: ``bare``: without a body; echo: with the point they reply to. Default: bare.
        state: reported state: ready, error, e-stop, manual or drives-off.
        speed: how many times faster than real time.
        wait_for_points: time stands still while the buffer is empty; otherwise an error.
    """

    capacity: int | None = None
    feedback: str | None = None
    feedback_period: float | None = None
    status: bool = True
    replies: str | None = None
    state: str = "ready"
    speed: float = 1.0
    wait_for_points: bool = False

    def options(self, link: Link, **settings: Any) -> ControllerOptions:
        """Makes the settings of the controller.

        Args:
            link: whose driver sets what is not stated.
            settings: further ones.

        Raises:
            InputError: an option out of range.
        """
        from oed.controllers import ControllerOptions

        settings |= {name: getattr(self, name) for name in ("status", "state", "speed", "wait_for_points")}
        settings |= link.settings() | stated(self, "capacity", "feedback", "feedback_period", "replies")
        driver = link.profile()
        return ControllerOptions(**settings) if driver is None else ControllerOptions.of(driver, **settings)


def stated(options: Any, *names: str) -> dict[str, Any]:
    """Gives the options that are not None.

    Args:
        options: a group of options.
        names: of its fields; one that it does not have counts as None.
    """
    return {name: getattr(options, name) for name in names if getattr(options, name, None) is not None}

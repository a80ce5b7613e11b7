"""What plays a trajectory on a controller, by whatever protocol."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator

from oed.controllers.clients.command_lag import CommandLag
from oed.controllers.clients.traffic import Traffic
from oed.controllers.errors import ControllerError
from oed.exports.simple_message import FullPoint, Point
from robots.common.arrays import Array

Watch = Callable[[], None]
Advance = Callable[[int], None]


class Sender(ABC):
    """Makes a controller ready, brings it the points, and stops it.

    Attributes:
        traffic: what happens is counted there.
        lag: how far the joints follow behind their commands; None where that is not known.
    """

    traffic: Traffic
    lag: CommandLag | None = None

    @abstractmethod
    def start(self) -> None:
        """Makes the controller ready.

        Raises:
            ControllerError: it does not become ready; the message says why.
        """

    @abstractmethod
    def stream(self, points: Iterable[FullPoint | Point], watch: Watch, advance: Advance, longest_step: float) -> None:
        """Brings the points in time; returns when all are confirmed.

        Args:
            points: in order.
            watch: raises where the stream must end for another reason.
            advance: is given the number of confirmed points.
            longest_step: of the trajectory [s].

        Raises:
            LinkError: a closed connection, or no reply within the patience.
            ControllerError: a point is refused, or the controller's program has ended.
        """

    @abstractmethod
    def stop(self) -> bool:
        """Orders the robot to stop; says whether that is confirmed."""

    def see(self, stamp: float, q: Array) -> None:
        """Takes a row of feedback: its time [s], and positions (n,) [rad or m]."""
        return

    def keep_alive(self) -> None:
        """Does what keeps the link open while the motion ends."""
        return

    def ping(self, patience: float | None = None) -> float:
        """Pings until an answer comes, and returns its round trip [s].

        Raises:
            ControllerError: a protocol without pings.
        """
        raise ControllerError("the controller knows no pings", remedy="leave out --ping")

    def download(self, points: Iterator[FullPoint | Point], watch: Watch, advance: Advance) -> None:
        """Brings all points before the robot starts.

        Raises:
            ControllerError: a protocol without downloads.
        """
        raise ControllerError("the controller takes no download", remedy="leave out --download")

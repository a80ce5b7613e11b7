"""How a trajectory is sent."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from oed.controllers.drivers import Driver
from oed.exports.simple_message.points import PointType
from robots.common.errors import InputError


@dataclass(frozen=True, kw_only=True)
class StreamOptions:
    """How a trajectory is sent.

    Attributes:
        driver: profile of the controller's program; None for what the other settings say.
        points: ``full`` for JOINT_TRAJ_PT_FULL, ``short`` for JOINT_TRAJ_PT.
        download: send all points at once without replies, instead of one after the other's reply.
        window: points on their way at once. More than one needs a controller whose replies repeat the point.
        reply_time: by UDP, a point without reply is sent again after so long [s].
        patience: longest wait for a reply, for feedback, or for the end of the motion [s].
        ping: whether to ping. Drivers that read packets of a fixed size take pings for points, and move.
        start_tolerance: farthest pose from the first point [rad or m].
        tolerance: farthest feedback from the plan [rad or m]: of all joints, or of each; infinity for a joint that is
            not watched. 0.05 rad or 0.02 m by default.
        timed: whether the controller plays in time. Otherwise only the path is watched.
        speed: how many times faster than real time a controller to test against plays.
        ignore_status: start in spite of a reported error, emergency stop or manual mode.
        download_rate: points a second of a download by UDP.
        robot_id: which robot of the controller.
        external_axes: whether the controller has axes behind those of the robot. Points hold them where they are
            reported; otherwise such a controller is refused.
    """

    driver: Driver | None = None
    points: PointType = "full"
    download: bool = False
    window: int = 1
    reply_time: float = 0.1
    patience: float = 2.0
    ping: bool = False
    start_tolerance: float = 0.01
    tolerance: float | tuple[float, ...] | None = None
    timed: bool = True
    speed: float = 1.0
    ignore_status: bool = False
    download_rate: float = 2000.0
    robot_id: int = 0
    external_axes: bool = False

    @classmethod
    def of(cls, driver: Driver, **changes: Any) -> StreamOptions:
        """Makes the settings of a driver.

        Args:
            driver: its profile.
            changes: other settings.

        Raises:
            InputError: a setting with which the driver does not do what is meant.
        """
        usual = {"points": driver.points, "download": driver.download, "timed": driver.timed}
        return cls(driver=driver, **(usual | changes))

    def __post_init__(self) -> None:
        """Checks the settings.

        Raises:
            InputError: an unknown type of points, a number out of range, or what a driver misreads.
        """
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

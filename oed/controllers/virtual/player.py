"""What the controller does with its points: it loads, plays, and stops, one sample of time after the other."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum, IntEnum

import numpy as np

from oed.controllers.virtual.buffer import Outcome, PointBuffer
from oed.controllers.virtual.faults.paths import PathFault
from oed.controllers.virtual.robot import VirtualRobot
from oed.controllers.virtual_options import ControllerOptions
from oed.exports.simple_message import FullPoint, Point, Special
from robots.common.arrays import Array


class Fault(IntEnum):
    """Error codes of the status message."""

    REPORTED = 1
    UNDERRUN = 2
    WRONG_START = 3
    GAP = 4
    BACKWARD = 5


class Phase(Enum):
    """What the player is doing."""

    IDLE = "idle"
    LOADING = "loading"
    PLAYING = "playing"


@dataclass(frozen=True, slots=True)
class Sample:
    """What the robot does at one time; torque where it is wanted."""

    q: Array
    dq: Array
    ddq: Array
    tau: Array | None


class Player:
    """Plays points on a robot that follows them exactly.

    Args:
        pose: where the robot stands (n,).
        robot: gives the torque; None without.
        options: of the controller.
    """

    def __init__(self, pose: Array, robot: VirtualRobot | None, options: ControllerOptions) -> None:
        self.pose = np.array(pose, dtype=float)
        self._robot = robot
        self._options = options
        n = len(self.pose)
        self._stream = PointBuffer(n, options.capacity, options.form, options.replies == "bare")
        # Points of a downloaded trajectory, at most.
        self._download = PointBuffer(n, 1_000_000, options.form, False)
        self._buffer = self._stream
        self._phase = Phase.IDLE
        self._error = 0
        self._last_accepted = 0.0
        self._ticks = self._elapsed = 0
        self._path = PathFault(options.faults.path, options.faults.path_after)
        self._last: Sample | None = None
        self._refilling = False
        self._numbers: list[int] = []
        self._ahead: list[Sample] = []
        self.accepted = self.played_trajectories = 0

    @property
    def phase(self) -> Phase:
        """What it is doing."""
        return self._phase

    @property
    def error(self) -> int:
        """The error code; 0 for none."""
        return self._error

    @property
    def moving(self) -> bool:
        """Whether a trajectory is played."""
        return self._phase == Phase.PLAYING

    def clear_error(self) -> None:
        """Ends an error of a trajectory; one that was ordered stays."""
        if self._error != Fault.REPORTED:
            self._error = 0

    def fail(self, code: Fault) -> None:
        """Stops with an error."""
        self.stop()
        self._error = code

    def stop(self) -> None:
        """Stops at once and forgets all points."""
        self._stream.clear()
        self._download.clear()
        self._numbers.clear()
        self._ahead.clear()
        self._phase = Phase.IDLE

    def put(self, point: FullPoint | Point, now: float, *, streaming: bool) -> Outcome | None:
        """Takes a point; None where an error ends the trajectory.

        Args:
            point: with its number, or a special one.
            now: time on the wall [s].
            streaming: whether it is part of a stream; otherwise of a download.
        """
        number = point.sequence
        if self._error:
            return None
        if not streaming or number in (Special.START_DOWNLOAD, Special.END):
            return self._put_download(point, now)
        buffer = self._stream
        if number == 0 and self._exhausted and buffer.end > 1:
            self.stop()
        if number == 0 and buffer.end == 0:
            self._buffer = buffer
            if not self._starts_here(point):
                return None
        outcome = buffer.accept(number, point)
        if outcome in (Outcome.GAP, Outcome.BACKWARD):
            self.fail(Fault.GAP if outcome == Outcome.GAP else Fault.BACKWARD)
            return None
        if outcome == Outcome.ACCEPTED:
            self._count(now)
        return outcome

    def tick(self, clock: float, now: float, heard: bool = True) -> Sample | None:
        """Goes on by one sample of time.

        Args:
            clock: the controller's time [s].
            now: time on the wall [s].
            heard: whether anyone asks for the torque at rest.

        Returns:
            What the robot does; None where time must wait for points.
        """
        # A buffer that is not full starts to play after so long [s] without a new point.
        load = 0.1
        if self._phase == Phase.LOADING and not self._options.faults.stuck:
            waited = now - self._last_accepted > load
            if self._buffer.end and (self._buffer.full or waited or self._buffer is self._download):
                self._phase, self._ticks, self._elapsed, self._last = Phase.PLAYING, 0, 0, None
                self._path.begin()
                if self._robot is not None:
                    self._robot.begin(clock)
        if self._phase != Phase.PLAYING:
            return self._stand(heard)
        if self._refilling and not self._buffer.full and now - self._last_accepted <= load:
            return None
        self._refilling = False
        sample = self._next()
        if sample is not None:
            self.pose = sample.q
            return sample
        buffer = self._buffer
        # Time that waits for points waits no longer than this [s].
        if self._options.wait_for_points and not buffer.at_rest and now - self._last_accepted < 2.0:
            # Piece by piece: one point at a time would cost a simulation each.
            self._refilling = True
            return None
        if buffer.at_rest or self._stands:
            if now - self._last_accepted > load:
                self._phase = Phase.IDLE
                self.played_trajectories += 1
            return self._stand(heard)
        self.fail(Fault.UNDERRUN)
        return self._stand(heard)

    @property
    def _exhausted(self) -> bool:
        buffer = self._buffer
        return buffer.end > 0 and buffer.played == buffer.end and (buffer.at_rest or self._stands)

    @property
    def _stands(self) -> bool:
        return self._options.driver is not None and self._options.driver.stands

    def _count(self, now: float) -> None:
        self.accepted += 1
        self._last_accepted = now
        if self._phase == Phase.IDLE:
            self._phase = Phase.LOADING

    def _starts_here(self, point: FullPoint | Point) -> bool:
        away = np.abs(np.array(point.positions[: len(self.pose)]) - self.pose).max()
        if away > self._options.start_tolerance:
            self.fail(Fault.WRONG_START)
        return not self._error

    def _put_download(self, point: FullPoint | Point, now: float) -> Outcome | None:
        number = point.sequence
        buffer = self._download
        if number == Special.START_DOWNLOAD:
            if self._phase == Phase.PLAYING:
                return Outcome.KNOWN
            self.stop()
            self._buffer = buffer
            if not self._starts_here(point):
                return None
            number = 0
        if number == Special.END:
            number = max(self._numbers, default=-1) + 1
            outcome = buffer.accept(number, point)
            if outcome != Outcome.ACCEPTED or buffer.end != number + 1 or not _even(buffer):
                self.fail(Fault.GAP)
                return None
            self._count(now)
            return outcome
        if self._buffer is not buffer or number < 0:
            self.fail(Fault.GAP)
            return None
        most = None if self._options.driver is None else self._options.driver.most
        if most is not None and len(self._numbers) >= most - 1:
            return Outcome.KNOWN
        outcome = buffer.accept(number, point)
        if outcome == Outcome.ACCEPTED:
            self.accepted += 1
            self._numbers.append(number)
        return outcome

    def _next(self) -> Sample | None:
        """Gives the next sample of the trajectory, or None at the end of the points."""
        elapsed = self._elapsed * self._options.feedback_period
        if self._last is not None and self._path.holds(elapsed):
            self._elapsed += 1
            return self._last
        if not self._ahead:
            self._look_ahead()
        if not self._ahead:
            return None
        self._buffer.pass_time(self._ticks * self._options.feedback_period)
        self._ticks += 1
        self._elapsed += 1
        sample = self._ahead.pop(0)
        self._last = replace(sample, q=self._path.moved(sample.q, elapsed))
        return self._last

    def _look_ahead(self) -> None:
        period, buffer = self._options.feedback_period, self._buffer
        if not buffer.points:
            return
        count = int(np.floor(buffer.points[-1].time / period + 1e-3)) + 1 - self._ticks
        # Points without velocities are not differentiated at the edge of what is known.
        if buffer.points[-1].dq is None and not buffer.at_rest and not self._stands:
            count -= 2
        if count <= 0:
            return
        # Samples whose torque is computed at once, at most.
        times: Array = (self._ticks + np.arange(min(count, 1000))).astype(np.float64) * period
        q, dq, ddq = buffer.sample(times)
        torques = [None] * len(times) if self._robot is None else self._robot.follow(times, q, dq, ddq)
        seen = q if self._robot is None else self._robot.encoders(q)
        self._ahead = [Sample(*row) for row in zip(seen, dq, ddq, torques, strict=True)]

    def _stand(self, heard: bool) -> Sample:
        zero = np.zeros_like(self.pose)
        torque = self._robot.stand(self.pose) if heard and self._robot is not None else None
        return Sample(self.pose, zero, zero, torque)


def _even(buffer: PointBuffer) -> bool:
    """Whether the last step is no longer than others: the number of the last point is not in its message."""
    steps = np.diff([point.time for point in buffer.points])
    return len(steps) < 2 or bool(steps[-1] <= 1.5 * steps[:-1].max())

"""Guides an ABB controller through a trajectory: each of its messages is answered with the position of that time."""

from __future__ import annotations

import time
from collections.abc import Iterable

import numpy as np

from oed.controllers.clients.command_lag import CommandLag
from oed.controllers.clients.sender import Advance, Array, Sender, Watch
from oed.controllers.clients.traffic import Traffic
from oed.controllers.egm.link import EgmLink
from oed.controllers.egm.messages import EgmForm
from oed.controllers.errors import NoReplyError
from oed.controllers.options import StreamOptions
from oed.controllers.recording.recorder import Recorder
from oed.exports.simple_message import FullPoint, MessageError, Point
from robots.robot import Robot
from robots.signals import Motion

APPROACH_TIME = 1.0
"""Time in which the robot is brought from where it stands to the first point [s]."""


GUIDE_POLL_PERIOD = 0.005


class GuidePlayer(Sender):
    """Plays by answers; see `Sender`.

    Args:
        link: to the controller.
        motion: what is played.
        robot: whose limit of acceleration a stop obeys, and whose axes the controller counts.
        options: of the stream.
        recorder: takes the messages, and so asks for the answers.
        traffic: what happens is counted there.
    """

    def __init__(
        self,
        link: EgmLink,
        motion: Motion,
        robot: Robot,
        options: StreamOptions,
        recorder: Recorder,
        traffic: Traffic,
    ) -> None:
        self._link, self._motion, self._options, self._recorder = link, motion, options, recorder
        self.traffic = traffic
        self._form = EgmForm(axes=robot.axes)
        acceleration = robot.limits.acceleration
        # A stop of a robot whose description has no limit [rad/s2].
        self._deceleration = np.where(np.isfinite(acceleration), acceleration, 5.0)
        self._number = 0
        self._start: float | None = None
        self._begin: Array | None = None
        self._elapsed = 0.0
        self._command: Array = motion.q[0]
        self._speed: Array = np.zeros(motion.n)
        self._stopping: float | None = None
        self.lag = self._lag = CommandLag(motion)

    def see(self, stamp: float, q: Array) -> None:
        """Takes a row of feedback; see `Sender.see`."""
        if self._elapsed > APPROACH_TIME and self._stopping is None:
            self._lag.see(self._elapsed - APPROACH_TIME, q)

    def start(self) -> None:
        """Begins to answer: the robot is brought to the first point."""
        assert self._recorder.positions is not None
        self._begin = self._recorder.positions[: self._motion.n]
        self._command = self._begin
        self.traffic.begun = True
        self._link.answer = self._answer

    def stream(self, points: Iterable[FullPoint | Point], watch: Watch, advance: Advance, longest_step: float) -> None:
        """Waits until the last point is the answer: positions are those of the controller's time."""
        count, last, changed = len(self._motion), -1.0, time.monotonic()
        while self.traffic.sent < count:
            watch()
            now = time.monotonic()
            if self._elapsed != last:
                last, changed = self._elapsed, now
            elif now - changed > self._options.patience:
                raise NoReplyError(f"{self._link.place} has not asked for a position for {now - changed:.1f} s")
            # The controller's cycle [s], unless the motion has one.
            place = (self._elapsed - APPROACH_TIME) / (self._motion.period or 0.004)
            self.traffic.sent = int(np.clip(np.floor(place + 1e-6) + 1, 0, count))
            advance(self.traffic.sent)
            time.sleep(GUIDE_POLL_PERIOD)

    def stop(self) -> bool:
        """Brings the robot to rest, then answers nothing more; says whether it stands."""
        if self._stopping is None:
            self._stopping = time.monotonic()
        # How long a stopped robot is held, before nothing more is answered [s].
        holds = 0.5
        longest = holds + float((np.abs(self._speed) / self._deceleration).max(initial=0.0))
        while time.monotonic() - self._stopping < longest and self._recorder.error is None:
            time.sleep(GUIDE_POLL_PERIOD)
        self._link.answer = None
        quiet = time.monotonic() - self._recorder.rest_since
        self.traffic.stopped = self._recorder.error is None and quiet > holds / 5
        return self.traffic.stopped

    def _answer(self, data: bytes) -> bytes | None:
        """Gives the position of a message's time; called by the thread that receives."""
        try:
            now = self._form.decode(data).message.time  # type: ignore[union-attr]
        except MessageError:
            return None
        if self._start is None:
            self._start = now
        before, elapsed = self._elapsed, now - self._start
        step = elapsed - before
        if self._stopping is not None:
            slower = np.maximum(np.abs(self._speed) - self._deceleration * max(step, 0.0), 0.0)
            self._speed = np.sign(self._speed) * slower
            self._command = self._command + self._speed * max(step, 0.0)
        else:
            wanted = self._planned(elapsed)
            if step > 0:
                self._speed = (wanted - self._command) / step
            self._command = wanted
        self._elapsed = elapsed
        self._number += 1
        return self._form.guide(self._number, self._command.tolist())

    def _planned(self, elapsed: float) -> Array:
        motion = self._motion
        assert self._begin is not None
        if elapsed < APPROACH_TIME:
            s = elapsed / APPROACH_TIME
            share = s**3 * (10 - 15 * s + 6 * s**2)
            found: Array = self._begin + share * (motion.q[0] - self._begin)
            return found
        t = motion.t - motion.t[0]
        place = min(elapsed - APPROACH_TIME, float(t[-1]))
        right = min(int(np.searchsorted(t, place, side="right")), len(t) - 1)
        left = max(right - 1, 0)
        share = (place - t[left]) / (t[right] - t[left]) if right > left else 0.0
        between: Array = motion.q[left] + share * (motion.q[right] - motion.q[left])
        return between

"""A thread that listens to the state port: it knows pose and state, and writes the log while recording is on."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from os import PathLike
from typing import Any

import numpy as np

from oed.controllers.egm.messages import EgmForm
from oed.controllers.errors import LinkError, ProtocolError, RecordingError
from oed.controllers.links import Link
from oed.controllers.recording.clock import ClockAnchor
from oed.controllers.recording.feed import Feed
from oed.controllers.recording.feedback import Layout, MessageForm, coarse_clock
from oed.controllers.recording.log_file import FeedbackLog
from oed.controllers.recording.statistics import Statistics
from oed.controllers.rtde.feedback import StateFeedback
from oed.exports.simple_message import (
    Comm,
    Frame,
    Message,
    MessageError,
    Ping,
    Reply,
    Status,
)
from robots.common.arrays import Array
from robots.common.errors import InputError, OedError
from robots.robot import Robot

FEEDBACK_TRIAL_TIME = 0.3
"""How long kinds of feedback are looked at before the best is chosen [s]."""


class Recorder:
    """Listens to feedback.

    Args:
        link: to the state port; it is closed at the end.
        robot: whose joints report.
        form: of the messages.
        patience: longest silence [s].
        connect_time: how long the first feedback is waited for [s].
        answers: whether requests of the controller are answered; otherwise nothing is sent to it.
    """

    def __init__(
        self, link: Link, robot: Robot, form: MessageForm, patience: float, connect_time: float, answers: bool = True
    ) -> None:
        self._link, self._robot, self._answers = link, robot, answers
        self._form = replace(form, axes=robot.axes) if isinstance(form, EgmForm) else form
        self._patience, self._connect_time = patience, connect_time
        self._lock = threading.Lock()
        self._end = threading.Event()
        self._heard = threading.Event()
        self._log: FeedbackLog | None = None
        self._feed = Feed(robot.n, form)
        self._offset, self._clock = 0.0, "controller"
        self.statistics = Statistics(link.reliable)
        self.status: Status | None = None
        self._status_count = 0
        self.played = 0
        """Counter of the program on the controller, where feedback has one."""
        self.positions: Array | None = None
        """All ten reals of the last feedback."""
        self.lowest: Array | None = None
        self.highest: Array | None = None
        """Extremes of the ten positions so far."""
        self.stamp: float | None = None
        """The controller's time of the last feedback, or ours where it sends none [s]."""
        self.rest_since = self.last_heard = self._last_row = time.monotonic()
        self.error: OedError | None = None
        self.watch: Callable[[float, Array], None] | None = None
        """Sees time and positions of each row; what it raises, `check` raises, and the recording goes on."""
        self._seen: OedError | None = None
        self.received = 0
        self.rows = 0
        """Rows of the log, once it has ended."""
        self.note = ""
        """What the log lacks, though it has all its rows; why its times are those of arrival."""
        self._thread = threading.Thread(target=self._run, name="feedback", daemon=True)
        self._thread.start()

    def wait_for_feedback(self) -> Array:
        """Waits for the first feedback and returns its ten positions.

        Raises:
            ProtocolError: none within the time to connect.
            LinkError: the link is closed.
        """
        begin = time.monotonic()
        while time.monotonic() - begin < self._connect_time and self.error is None and not self._heard.is_set():
            self._heard.wait(0.05)
        self.check()
        if self.positions is None:
            raise ProtocolError(
                f"no feedback from {self._link.place} within {self._connect_time:g} s"
                + (f": {self._why_no_row()}" if self._feed.problem or self.status is not None else ""),
                remedy="check the state port and the message format; it may be no simple_message controller"
                if self.status is None
                else "check the controller's program, which sends it",
            )
        # Other kinds, and the status, may come less often.
        time.sleep(FEEDBACK_TRIAL_TIME)
        self.check()
        return self.positions

    def check(self) -> None:
        """Raises what ended the recording.

        Raises:
            OedError: a closed link, a full disk, a restarted controller, or a silent one.
        """
        if self.error is not None or self._seen is not None:
            raise self.error or self._seen  # type: ignore[misc]
        silence = time.monotonic() - self._last_row
        if silence > self._patience and self._heard.is_set():
            # A state may come just after the last row; one that still comes later shows a live controller.
            if self.last_heard - self._last_row < silence / 2:
                problem, remedy = f"{self._link.place} is silent for {silence:.1f} s", "the controller and the network"
            else:
                problem = f"no feedback from {self._link.place} for {silence:.1f} s: {self._why_no_row()}"
                remedy = "the controller's program, which sends it"
            raise LinkError(problem, remedy=f"check {remedy}")

    def _why_no_row(self) -> str:
        return self._feed.problem or "its state arrives, but no positions"

    def is_moving(self, tolerance: float) -> bool:
        """Whether the robot moves: its controller says so, or its positions so far differ by more than a tolerance."""
        if self.status is not None and self.status.in_motion >= 0:
            return self.status.in_motion == 1
        if self.lowest is None or self.highest is None:
            return False
        return float(np.abs(self.highest - self.lowest).max()) > tolerance

    @property
    def layout(self) -> Layout:
        """What the feedback carries, once there is any."""
        assert self._feed.layout is not None
        return self._feed.layout

    def renewed_status(self) -> Status | None:
        """Waits for a state that is reported from now on; gives the last one where none comes in time."""
        # How long a state is waited for that was reported after a given moment [s]: states come ten a second.
        count, end = self._status_count, time.monotonic() + 0.3
        # The next one may have been on its way already.
        while self._status_count < count + 2 and time.monotonic() < end and self.error is None:
            time.sleep(0.01)
        return self.status

    def begin(
        self,
        path: str | PathLike[str],
        metadata: Mapping[str, Any],
        *,
        anchor: ClockAnchor | None = None,
        delay: float | None = None,
        force: bool = False,
    ) -> None:
        """Begins to write a log.

        Args:
            path: the file.
            metadata: what is known at the beginning.
            anchor: the end of the log whose clock this one continues.
            delay: of a message [s]. Where feedback carries no time, a row's time is that of its arrival less this.
            force: whether an existing file may be replaced.

        Raises:
            InputError: a file that cannot be written.
        """
        layout = self._feed.layout
        assert layout is not None
        units = ["m" if joint.kind == "prismatic" else "rad" for joint in self._robot.chain.joints]
        assert self.stamp is not None
        self._clock = "controller" if layout.stamped else "arrival"
        late = 0.0 if layout.stamped else delay or 0.0
        offset = -late if anchor is None else anchor.offset_of(self.stamp, time.time(), self._clock)
        known = {**metadata, "clock": self._clock, "complete": False}
        if late:
            known["delay_removed"] = late
        if offset != -late:
            known["clock_offset"] = offset + late
        log = FeedbackLog(path, layout.columns, layout.units(units), known, digits=layout.digits, force=force)
        with self._lock:
            self.statistics = Statistics(self._link.reliable)
            self.statistics.stamped = layout.stamped
            self._feed.forget()
            self._offset = offset
            self._log = log

    def anchor(self) -> ClockAnchor | None:
        """Gives the end of the log, for one that continues its clock; None without rows."""
        end = self.statistics.end
        return None if end is None else ClockAnchor(t=end, unix=time.time(), offset=self._offset, clock=self._clock)

    def finish(self, metadata: Mapping[str, Any]) -> None:
        """Ends the log and the thread, and closes the link.

        Args:
            metadata: what is known at the end; the measured rate, loss and jitter are added.

        Raises:
            RecordingError: the disk is full, and the last rows are lost; what was recorded stays.
        """
        self._end.set()
        self._thread.join()
        self._link.close()
        with self._lock:
            log, self._log = self._log, None
        if log is None:
            return
        try:
            log.close()
        finally:
            self.rows = log.rows
            if not log.rows:
                log.discard()
        if not log.rows or isinstance(self.error, RecordingError):
            return
        try:
            log.complete({"complete": True, **metadata, "feedback": self.statistics.summary()})
        except OedError as error:
            self.note = "\n".join(
                filter(None, [self.note, f"the log does not state the measured delay and loss: {error}"])
            )

    def _run(self) -> None:
        try:
            while not self._end.is_set():
                data = self._link.receive(0.05)
                if data is None:
                    if self._log is not None:
                        self._log.flush()
                    continue
                self.received += 1
                try:
                    frame = self._form.decode(data)
                except MessageError as error:
                    self.statistics.malformed += 1
                    self._feed.problem, self.last_heard = f"what comes is no message ({error})", time.monotonic()
                    continue
                self._take(frame, time.monotonic())
        except MessageError as error:
            self.error = ProtocolError(f"{self._link.place} speaks another protocol: {error}")
        except OedError as error:
            self.error = error

    def _take(self, frame: Frame, now: float) -> None:
        message = frame.message
        if frame.comm == Comm.REQUEST and self._answers:
            self._link.send(self._form.encode(Frame(_echo(message), Comm.REPLY, Reply.SUCCESS)))
        self.last_heard = now
        if isinstance(message, Status):
            self.status = message
            self._status_count += 1
            return
        stamp = self._feed.time_of(message, now, self._log is None)
        self.statistics.late = self._feed.late
        if stamp is None:
            return
        if isinstance(message, StateFeedback):
            self.status, self.played = message.status, message.played
            self._status_count += 1
        layout = self._feed.layout
        assert layout is not None
        self._feed.problem, self._last_row = "", now
        positions = np.array(message.positions)  # type: ignore[union-attr]
        if len(positions) < self._robot.n:
            raise InputError(
                f"the controller reports {len(positions)} joints, {self._robot.name} has {self._robot.n}",
                remedy="the controller is of another robot: correct --robot",
            )
        # Positions that change by less are at rest [rad or m].
        if self.positions is None or np.abs(positions - self.positions).max() > 1e-5:
            self.rest_since = now
        self.positions, self.stamp = positions, stamp
        if self.watch is not None and self._seen is None:
            try:
                self.watch(stamp, positions[: self._robot.n])
            except OedError as error:
                self._seen = error
        self.lowest = positions if self.lowest is None else np.minimum(self.lowest, positions)
        self.highest = positions if self.highest is None else np.maximum(self.highest, positions)
        if self._log is None:
            self.note = coarse_clock(message, self._form)
        self._heard.set()
        with self._lock:
            if self._log is not None:
                t = stamp + self._offset
                self.statistics.add(t, now)
                self._log.append(t, layout.row(message))  # type: ignore[arg-type]


def _echo(message: Message) -> Message:
    return Ping() if isinstance(message, Ping) else message

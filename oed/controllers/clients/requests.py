"""Requests and their replies: points with a window, and the stop."""

from __future__ import annotations

import time
from collections import OrderedDict
from collections.abc import Iterable, Iterator
from contextlib import suppress

from oed.controllers.clients.channel import Channel
from oed.controllers.clients.replies import Verdict, answer_of, confirms_stop, described, reason
from oed.controllers.clients.sender import Advance, Sender, Watch
from oed.controllers.clients.traffic import Request, Traffic
from oed.controllers.errors import ControllerError, NoReplyError, PointRefusedError
from oed.controllers.links import Link
from oed.controllers.options import StreamOptions
from oed.exports.simple_message import (
    Bare,
    Comm,
    Command,
    Frame,
    FullPoint,
    Kind,
    MotionControl,
    MotionReply,
    Point,
    Result,
    Special,
    Valid,
    WireFormat,
)
from robots.common.errors import OedError

START_TIMEOUT = 10.0
"""How long drives may take to get power [s]."""


class Requests(Channel, Sender):
    """Sends points and stops as requests and looks at the replies; see `Channel`."""

    def __init__(self, link: Link, form: WireFormat, options: StreamOptions, traffic: Traffic | None = None) -> None:
        super().__init__(link, form, options, traffic)
        self._unanswered = 0
        self._came = ""
        self._commands = options.driver is not None and options.driver.commands

    @property
    def _kind(self) -> int:
        return Kind.JOINT_TRAJ_PT_FULL if self._options.points == "full" else Kind.JOINT_TRAJ_PT

    def start(self) -> None:
        """Makes a driver ready that waits for a command, as Motoman's: its drives get power.

        Raises:
            ControllerError: it does not become ready; the message says why.
        """
        driver = self._options.driver
        if driver is None or not driver.commands:
            return
        order = MotionControl(robot_id=self._options.robot_id, command=Command.START)
        self._put(self._form.encode(Frame(order, Comm.REQUEST)))
        end = time.monotonic() + START_TIMEOUT
        while (left := end - time.monotonic()) > 0:
            frame = self._received(left)
            reply = None if frame is None else frame.message
            if isinstance(reply, MotionReply) and reply.command == Command.START:
                if reply.result == Result.SUCCESS:
                    return
                raise ControllerError(
                    f"{driver.title} is not ready: it reports {reason(reply)}",
                    remedy="clear it at the controller: remote and play mode, no alarm, no emergency stop",
                )
        raise ControllerError(
            f"{driver.title} does not answer its start command for {START_TIMEOUT:g} s",
            remedy="check the motion port and --driver",
        )

    def stream(self, points: Iterable[FullPoint | Point], watch: Watch, advance: Advance, longest_step: float) -> None:
        """Sends points as requests, each once it may be; returns when all are confirmed.

        Args:
            points: in order.
            watch: raises where the stream must end for another reason.
            advance: is given the number of confirmed points.
            longest_step: of the trajectory [s]; a full buffer may keep a reply back for so long.

        Raises:
            PointRefusedError: a point that is refused.
            NoReplyError: no reply within the patience.
            LinkError: a closed connection, or another protocol.
        """
        waiting: OrderedDict[int, Request] = OrderedDict()
        source = iter(points)
        window, known, patience = 1, False, self._options.patience + longest_step
        more = True
        while more or waiting:
            watch()
            while more and len(waiting) < window:
                point = next(source, None)
                if point is None:
                    more = False
                    break
                self._send(waiting, point)
            if not waiting:
                break
            frame = self._received(self._next_turn(waiting))
            now = time.monotonic()
            if frame is not None and frame.comm == Comm.REPLY:
                self._unanswered = max(self._unanswered - 1, 0)
                number = self._answered(frame, waiting)
                if number is None:
                    self.traffic.unexpected += bool(self._came)
                else:
                    request = waiting.pop(number)
                    if request.tries == 1:
                        self.traffic.shortest = min(self.traffic.shortest, now - request.first)
                    self.traffic.sent += 1
                    self._came = ""
                    advance(self.traffic.sent)
                    if not known:
                        known, window = True, 1 if isinstance(frame.message, Bare) else self._options.window
                    if isinstance(frame.message, Bare) and request.tries > 1:
                        self._drain(request.tries - 1)
            self._again(waiting, now, patience)

    def download(self, points: Iterator[FullPoint | Point], watch: Watch, advance: Advance) -> None:
        """Sends points as topics, the first and the last with their special numbers.

        Args:
            points: in order.
            watch: raises where the download must end for another reason.
            advance: is given the number of sent points.

        Raises:
            LinkError: a closed connection.
        """
        held: FullPoint | Point | None = None
        begin = time.monotonic()
        for point in points:
            if held is not None:
                self._topic(held, Special.START_DOWNLOAD if held.sequence == 0 else held.sequence)
                advance(self.traffic.sent)
                if not self.link.reliable:
                    ahead = begin + self.traffic.sent / self._options.download_rate - time.monotonic()
                    if ahead > 0.002:
                        time.sleep(ahead)
                watch()
            held = point
        if held is not None:
            self._topic(held, Special.END)
            advance(self.traffic.sent)

    def stop(self) -> bool:
        """Orders the robot to stop, several times if need be; says whether the controller confirmed it."""
        order: FullPoint | Point | MotionControl
        if self._commands:
            order = MotionControl(robot_id=self._options.robot_id, command=Command.STOP)
        elif self._options.points == "full":
            order = FullPoint(
                robot_id=self._options.robot_id,
                sequence=Special.STOP,
                valid=Valid.NONE,
                time=0.0,
                positions=(),
                velocities=(),
                accelerations=(),
            )
        else:
            order = Point(sequence=Special.STOP, positions=(), velocity=0.0, duration=0.0)
        data = self._form.encode(Frame(order, Comm.REQUEST))
        # By UDP the late reply to a point, without a body, looks like that to a stop that is lost.
        # How often a stop that is not confirmed is sent.
        tries = 5
        doubtful = 0 if self.link.reliable else min(self._unanswered, tries - 1)
        with suppress(OedError):
            for _ in range(1 if self.link.reliable else tries):
                self._put(data)
                end = time.monotonic() + (0.5 if self.link.reliable else self._options.reply_time)
                while (left := end - time.monotonic()) > 0:
                    frame = self._received(left)
                    if frame is None or frame.comm != Comm.REPLY or not confirms_stop(frame, self._kind):
                        continue
                    if not isinstance(frame.message, Bare) or not doubtful:
                        self.traffic.stopped = True
                        return True
                    doubtful -= 1
                    break
        return False

    def _send(self, waiting: OrderedDict[int, Request], point: FullPoint | Point) -> None:
        data = self._form.encode(Frame(point, Comm.REQUEST))
        self.traffic.begun = True
        self._unanswered += 1
        self._put(data)
        self._last_sent = now = time.monotonic()
        waiting[point.sequence] = Request(data, now, now)

    def _topic(self, point: FullPoint | Point, number: int) -> None:
        if isinstance(point, FullPoint):
            numbered: FullPoint | Point = FullPoint(
                robot_id=point.robot_id,
                sequence=number,
                valid=point.valid,
                time=point.time,
                positions=point.positions,
                velocities=point.velocities,
                accelerations=point.accelerations,
            )
        else:
            numbered = Point(
                sequence=number, positions=point.positions, velocity=point.velocity, duration=point.duration
            )
        self.traffic.begun = True
        self._put(self._form.encode(Frame(numbered, Comm.TOPIC)))
        self._last_sent = time.monotonic()
        self.traffic.sent += 1

    def _next_turn(self, waiting: OrderedDict[int, Request]) -> float:
        # Longest wait between two looks at what else happens [s].
        turn = 0.02
        if self.link.reliable:
            return turn
        oldest = min(request.sent for request in waiting.values())
        return min(turn, max(0.0, oldest + self._options.reply_time - time.monotonic()))

    def _answered(self, frame: Frame, waiting: OrderedDict[int, Request]) -> int | None:
        """Gives the number of the point that a reply confirms; None for one that confirms none."""
        # Who replies so refuses a stop that is a point.
        self._commands = self._commands or isinstance(frame.message, MotionReply)
        answer = answer_of(frame, self._kind)
        number, oldest = answer.number, next(iter(waiting))
        # Drivers need not repeat the number. By TCP replies come in the order of the points.
        if number is None or (number <= 0 and number not in waiting and self.link.reliable):
            number = oldest
        if answer.verdict == Verdict.OTHER or number not in waiting:
            self._came = described(frame)
            return None
        if answer.verdict == Verdict.REFUSED:
            raise PointRefusedError(
                f"the controller refuses point {number}" + (f": it reports {answer.why}" if answer.why else ""),
                remedy="see its display: a limit, an error, a lost point or an empty buffer are usual causes",
            )
        if answer.verdict == Verdict.BUSY:
            # A driver that is busy with a point is asked again after so long [s].
            time.sleep(0.002)
            self._put(waiting[number].data)
            waiting[number].tries += 1
            return None
        return int(number)

    def _again(self, waiting: OrderedDict[int, Request], now: float, patience: float) -> None:
        """Sends again what was not answered, up to the patience."""
        for number, request in waiting.items():
            if now - request.first > patience:
                came = f"; {self._came} came instead" if self._came else ""
                raise NoReplyError(
                    f"no reply to point {number} for {now - request.first:.1f} s from {self.link.place}{came}",
                    remedy="check the controller and the network",
                )
            if not self.link.reliable and now - request.sent >= self._options.reply_time:
                self._put(request.data)
                self._unanswered += 1
                request.sent = now
                request.tries += 1
                self.traffic.resent += 1

    def _drain(self, most: int) -> None:
        """Waits for the replies to points that were sent again: without a body they look like those of later points."""
        end = time.monotonic() + self._options.reply_time
        while most and (left := end - time.monotonic()) > 0:
            if self._received(left) is not None:
                self._unanswered = max(self._unanswered - 1, 0)
                self.traffic.unexpected += 1
                most -= 1

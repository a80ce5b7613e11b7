"""Requests and their replies: pings, points with a window, and the stop."""

from __future__ import annotations

import time
from collections import OrderedDict
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress

from oed.controllers.clients.options import StreamOptions
from oed.controllers.clients.traffic import Request, Traffic
from oed.controllers.errors import ControllerError, LinkError, NoReplyError, PointRefusedError, ProtocolError
from oed.controllers.links import Link
from oed.exports.simple_message import (
    Bare,
    Comm,
    Frame,
    FullPoint,
    Kind,
    MessageError,
    Ping,
    Point,
    Reply,
    Special,
    WireFormat,
)
from robots.common.errors import OedError

STOPS = 5
"""How often a stop that is not confirmed is sent."""

TURN = 0.05
"""Longest wait between two looks at what else happens [s]."""


class Requests:
    """Sends requests over one link and looks at the replies.

    Args:
        link: to the motion port.
        form: of the messages.
        options: of the stream.
        traffic: what happens is counted there.
    """

    def __init__(self, link: Link, form: WireFormat, options: StreamOptions, traffic: Traffic | None = None) -> None:
        self.link = link
        self.traffic = traffic or Traffic()
        self._form = form
        self._options = options
        self._last_sent = 0.0
        self._last_data = b""

    def ping(self, patience: float | None = None) -> float:
        """Pings until an answer comes, and returns its round trip [s].

        Raises:
            ProtocolError: no ping was ever answered.
            LinkError: no answer any more.
        """
        data = self._form.encode(Frame(Ping(), Comm.REQUEST))
        end = time.monotonic() + (self._options.patience if patience is None else patience)
        wrong: str | None = None
        while time.monotonic() < end:
            start = time.monotonic()
            self._put(data)
            until = min(end, start + (self._options.patience if self.link.reliable else self._options.reply_time))
            while (left := until - time.monotonic()) > 0:
                try:
                    frame = self._received(left, strict=True)
                except MessageError as error:
                    wrong = str(error)
                    continue
                if frame is not None and frame.comm == Comm.REPLY and frame.message.kind == Kind.PING:
                    if frame.reply != Reply.SUCCESS:
                        raise ControllerError(f"{self.link.place} refuses a ping")
                    self.traffic.pings.append(time.monotonic() - start)
                    self._last_sent = start
                    return self.traffic.pings[-1]
        if wrong is not None:
            raise ProtocolError(f"{self.link.place} speaks another protocol or format: {wrong}")
        raise (LinkError if self.traffic.pings else ProtocolError)(
            f"{self.link.place} does not answer a ping",
            remedy="check host and motion port; a controller may know no pings: leave out --ping",
        )

    def keep_alive(self) -> None:
        """Pings if nothing was sent for half a second, without waiting long."""
        if self._options.ping and time.monotonic() - self._last_sent > 0.5:
            self.ping()

    def stream(
        self,
        points: Iterable[FullPoint | Point],
        watch: Callable[[], None],
        advance: Callable[[int], None],
        longest_step: float,
    ) -> None:
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
                number = self._answered(frame, waiting)
                if number is None:
                    self.traffic.unexpected += 1
                else:
                    request = waiting.pop(number)
                    if request.tries == 1:
                        self.traffic.shortest = min(self.traffic.shortest, now - request.first)
                    self.traffic.sent += 1
                    advance(self.traffic.sent)
                    if not known:
                        known, window = True, 1 if isinstance(frame.message, Bare) else self._options.window
                    if isinstance(frame.message, Bare) and request.tries > 1:
                        self._drain(request.tries - 1)
            self._again(waiting, now, patience)

    def download(
        self, points: Iterator[FullPoint | Point], watch: Callable[[], None], advance: Callable[[int], None]
    ) -> None:
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
        if self._options.points == "full":
            order: FullPoint | Point = FullPoint(
                robot_id=self._options.robot_id,
                sequence=Special.STOP,
                time=0.0,
                positions=(),
                velocities=(),
                accelerations=(),
            )
        else:
            order = Point(sequence=Special.STOP, positions=(), velocity=0.0, duration=0.0)
        data = self._form.encode(Frame(order, Comm.REQUEST))
        with suppress(OedError):
            for _ in range(1 if self.link.reliable else STOPS):
                self._put(data)
                end = time.monotonic() + (0.5 if self.link.reliable else self._options.reply_time)
                while (left := end - time.monotonic()) > 0:
                    frame = self._received(left)
                    if frame is not None and frame.comm == Comm.REPLY and _confirms_stop(frame, order):
                        self.traffic.stopped = True
                        return True
        return False

    def _send(self, waiting: OrderedDict[int, Request], point: FullPoint | Point) -> None:
        data = self._form.encode(Frame(point, Comm.REQUEST))
        self.traffic.begun = True
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
        if self.link.reliable:
            return TURN
        oldest = min(request.sent for request in waiting.values())
        return min(TURN, max(0.0, oldest + self._options.reply_time - time.monotonic()))

    def _answered(self, frame: Frame, waiting: OrderedDict[int, Request]) -> int | None:
        """Gives the number of the point that a reply is for; None for one that is not expected."""
        if frame.message.kind != (Kind.JOINT_TRAJ_PT_FULL if self._options.points == "full" else Kind.JOINT_TRAJ_PT):
            return None
        number = next(iter(waiting)) if isinstance(frame.message, Bare) else frame.message.sequence  # type: ignore[union-attr]
        if number not in waiting:
            return None
        if frame.reply != Reply.SUCCESS:
            raise PointRefusedError(
                f"the controller refuses point {number}",
                remedy="see its display: a limit, an error, a lost point or an empty buffer are usual causes",
            )
        return int(number)

    def _again(self, waiting: OrderedDict[int, Request], now: float, patience: float) -> None:
        """Sends again what was not answered, up to the patience."""
        for number, request in waiting.items():
            if now - request.first > patience:
                raise NoReplyError(
                    f"no reply to point {number} for {now - request.first:.1f} s from {self.link.place}",
                    remedy="check the controller and the network",
                )
            if not self.link.reliable and now - request.sent >= self._options.reply_time:
                self._put(request.data)
                request.sent = now
                request.tries += 1
                self.traffic.resent += 1

    def _drain(self, most: int) -> None:
        """Waits for the replies to points that were sent again: without a body they look like those of later points."""
        end = time.monotonic() + self._options.reply_time
        while most and (left := end - time.monotonic()) > 0:
            if self._received(left) is not None:
                self.traffic.unexpected += 1
                most -= 1

    def _put(self, data: bytes) -> None:
        self._last_data = data
        self.link.send(data)

    def _received(self, timeout: float, *, strict: bool = False) -> Frame | None:
        """Waits for a message; a datagram that is none counts as unexpected."""
        try:
            data = self.link.receive(timeout)
            if data is None:
                return None
            if data == self._last_data:
                raise ProtocolError(f"{self.link.place} sends back what it is sent: it is no simple_message controller")
            return self._form.decode(data)
        except MessageError as error:
            self.traffic.unexpected += 1
            if self.link.reliable:
                raise ProtocolError(f"{self.link.place} speaks another protocol: {error}") from error
            if strict:
                raise
            return None


def _confirms_stop(frame: Frame, order: FullPoint | Point) -> bool:
    if frame.message.kind != order.kind or frame.reply != Reply.SUCCESS:
        return False
    return isinstance(frame.message, Bare) or getattr(frame.message, "sequence", None) == Special.STOP

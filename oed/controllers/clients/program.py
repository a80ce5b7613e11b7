"""Plays points on a UR controller: a program that takes them over a socket, and the side that sends them."""

from __future__ import annotations

import random
import socket
import struct
import time
from collections import deque
from collections.abc import Iterable
from contextlib import suppress

import numpy as np

from oed.controllers.clients.command_lag import CommandLag
from oed.controllers.clients.sender import Advance, Array, Sender, Watch
from oed.controllers.clients.traffic import Traffic
from oed.controllers.errors import ControllerError, NoReplyError
from oed.controllers.options import StreamOptions
from oed.controllers.recording.recorder import Recorder
from oed.controllers.rtde.link import ScriptLink
from oed.exports.forms.urscript import SERVO_GAIN, SERVO_LOOKAHEAD, SERVO_SETTLING, start_check
from oed.exports.simple_message import FullPoint, Point
from robots.common.errors import OedError
from robots.robot import Robot
from robots.signals import Motion

STEPS_PER_RADIAN = 100_000_000
"""Points travel as whole numbers of 4 bytes; one is so many parts of a radian."""

COUNTS_PER_TOKEN = 2**20
"""Points of a run are counted from a multiple of this number, another one each time."""

CONNECT_TIMEOUT = 5.0
"""How long the program may take to connect back [s]."""

SENT_AHEAD = 0.2
"""Points are sent so long before they are executed [s]: later a network may be, and sooner a robot stops by itself."""

PROGRAM_POLL_PERIOD = 0.002

PROGRAM = """\
def oed_stream():
  write_output_integer_register(24, {token})
{check}
  if not socket_open("{host}", {port}, "oed"):
    popup("No connection to the computer that sends the trajectory.", error=True, blocking=False)
    halt
  end
  played = 0
  going = True
  point = socket_read_binary_integer(7, "oed", {first})
  while going:
    if point[0] < 7:
      going = False
    elif point[1] < 1:
      going = False
    else:
      servoj([{joints}], 0, 0, {period}, {lookahead}, {gain})
      played = played + 1
      write_output_integer_register(24, {token} + played)
      point = socket_read_binary_integer(7, "oed", {patience})
    end
  end
  stopj({deceleration})
  socket_close("oed")
end
"""
"""Reads points from a socket, whose buffer keeps those that come early, and executes each for one period.

Without a point for a short time the robot decelerates, and the program ends.
"""

STOP = """\
def oed_stop():
  stopj({deceleration})
end
"""


class ProgramPlayer(Sender):
    """Sends a program to a UR controller, then the points to the program; see `Sender`.

    Args:
        link: to the port for programs.
        host: address of this computer, as the controller sees it.
        motion: what is played, at a period of the controller.
        robot: whose limit of acceleration a stop obeys.
        options: of the stream.
        recorder: its feedback says which points were executed.
        traffic: what happens is counted there.
    """

    WAITS = 0.1
    """The program ends if no point comes for so long [s]."""

    def __init__(
        self,
        link: ScriptLink,
        host: str,
        motion: Motion,
        robot: Robot,
        options: StreamOptions,
        recorder: Recorder,
        traffic: Traffic,
    ) -> None:
        self._link, self._host, self._options, self._recorder = link, host, options, recorder
        self.traffic = traffic
        self._period = motion.period or 0.0
        self._first = motion.q[0]
        self._count = len(motion)
        self._token = COUNTS_PER_TOKEN * random.randrange(1, 1000)
        acceleration = robot.limits.acceleration
        finite = acceleration[np.isfinite(acceleration)]
        # A stop of a robot whose description has no limit [rad/s2].
        self._deceleration = float(finite.min()) if finite.size else 5.0
        self._points: socket.socket | None = None
        self._listener: socket.socket | None = None
        self._finished = False
        self.lag = self._lag = CommandLag(motion)

    @property
    def played(self) -> int:
        """Points that the program has executed, those that hold the end included."""
        count = self._recorder.played - self._token
        return count if 0 <= count < COUNTS_PER_TOKEN else 0

    def see(self, stamp: float, q: Array) -> None:
        """Takes a row of feedback; see `Sender.see`."""
        # A point is counted when the next one begins.
        count = self.played
        if count:
            self._lag.see(min(count, self._count - 1) * self._period, q)

    def keep_alive(self) -> None:
        """Reads what the port for programs says."""
        self._link.drain()

    def start(self) -> None:
        """Starts the program and waits until it connects.

        Raises:
            ControllerError: it does not connect.
        """
        self._listener = socket.create_server((self._host, 0))
        self._listener.settimeout(PROGRAM_POLL_PERIOD)
        port = self._listener.getsockname()[1]
        self.traffic.begun = True
        self._link.run(self._program(port))
        end = time.monotonic() + CONNECT_TIMEOUT
        while time.monotonic() < end:
            self._recorder.check()
            self._link.drain()
            with suppress(TimeoutError):
                self._points, _ = self._listener.accept()
                self._points.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                self._points.setblocking(False)
                return
        raise ControllerError(
            f"the program on the controller does not connect to {self._host}:{port} for {CONNECT_TIMEOUT:g} s",
            remedy="set the controller to remote control, see its messages, and let it through the firewall of this "
            "computer",
        )

    def stream(self, points: Iterable[FullPoint | Point], watch: Watch, advance: Advance, longest_step: float) -> None:
        """Sends points, each `SENT_AHEAD` of its time; see `Sender.stream`."""
        assert self._points is not None
        data = deque(
            struct.pack(">7i", 1, *(round(q * STEPS_PER_RADIAN) for q in point.positions[: len(self._first)]))
            for point in points
        )
        # The robot follows later: the end is held until it is there.
        total = len(data) + int(np.ceil(SERVO_SETTLING / self._period))
        data.extend([data[-1]] * (total - len(data)))
        data.append(struct.pack(">7i", 0, *[0] * 6))
        ahead = int(np.ceil(SENT_AHEAD / self._period))
        sent, rest, last, changed, ended = 0, b"", 0, time.monotonic(), None
        while True:
            watch()
            self._link.drain()
            played, now = self.played, time.monotonic()
            if played != last:
                last, changed = played, now
                self.traffic.sent = min(played, self._count)
                advance(self.traffic.sent)
            if played >= total:
                self._finished = True
                return
            while data and sent <= played + ahead:
                rest += data.popleft()
                sent += 1
            rest = self._put(rest)
            status = self._recorder.status
            runs = status is None or status.in_motion == 1
            ended = None if runs else (ended or now)
            # A program that is reported as ended for so long has ended [s].
            if ended is not None and now - ended > 0.5:
                raise ControllerError(
                    f"the program on the controller ended after point {self.traffic.sent}",
                    remedy="see its messages: a stop at the controller, a limit, another program or another start pose "
                    "are usual causes",
                )
            if now - changed > self._options.patience:
                raise NoReplyError(
                    f"no point was executed for {now - changed:.1f} s after point {self.traffic.sent}",
                    remedy="check the controller and the network",
                )
            time.sleep(PROGRAM_POLL_PERIOD)

    def stop(self) -> bool:
        """Replaces the program by one that stops the robot; says whether it stands."""
        with suppress(OSError):
            if self._points is not None:
                self._points.close()
            if self._listener is not None:
                self._listener.close()
        recorder = self._recorder
        with suppress(OedError):
            if not self._finished:
                self._link.run(STOP.format(deceleration=self._deceleration))
            # How long a robot may take to stand after a stop [s].
            end = time.monotonic() + 3.0
            while time.monotonic() < end and recorder.error is None:
                self._link.drain()
                status, quiet = recorder.status, time.monotonic() - recorder.rest_since
                if status is not None and status.in_motion != 1 and quiet > self.WAITS:
                    self.traffic.stopped = True
                    return True
                time.sleep(PROGRAM_POLL_PERIOD)
        return False

    def _put(self, data: bytes) -> bytes:
        """Sends what the socket takes, and gives the rest."""
        assert self._points is not None
        if not data:
            return data
        try:
            return data[self._points.send(data) :]
        except BlockingIOError:
            return data
        except OSError:
            # The program has closed its end; its state says why.
            return b""

    def _program(self, port: int) -> str:
        joints = ", ".join(f"point[{place}] / {STEPS_PER_RADIAN}" for place in range(2, 8))
        return PROGRAM.format(
            token=self._token,
            check="\n".join(start_check(self._first, self._options.start_tolerance)),
            host=self._host,
            port=port,
            first=CONNECT_TIMEOUT,
            patience=self.WAITS,
            joints=joints,
            period=self._period,
            lookahead=SERVO_LOOKAHEAD,
            gain=SERVO_GAIN,
            deceleration=self._deceleration,
        )

"""Which messages of a controller make rows, and what ends a recording that gets none."""

from __future__ import annotations

import queue
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from oed.controllers import ControllerError, LinkError
from oed.controllers.errors import ProtocolError
from oed.controllers.links import Link
from oed.controllers.recording.feed import BACKWARD_TIME
from oed.controllers.recording.recorder import Recorder
from oed.exports.simple_message import DEFAULT, Frame, JointFeedback, Message, Status, TorqueFeedback, Valid
from robots.robot import Robot

USUAL = Valid.TIME | Valid.POSITION
STATUS = Status(drives_powered=1, e_stopped=0, error_code=0, in_error=0, in_motion=0, mode=2, motion_possible=1)
PATIENCE = 0.4


class _Feedback(Link):
    """A link that gives the messages that a test puts in."""

    place, reliable = "a test", False

    def __init__(self) -> None:
        self.messages: queue.Queue[bytes] = queue.Queue()

    def send(self, data: bytes) -> None:
        """Takes no answer."""

    def receive(self, timeout: float) -> bytes | None:
        """Gives the next message."""
        try:
            return self.messages.get(timeout=timeout)
        except queue.Empty:
            return None

    def close(self) -> None:
        """Has nothing to close."""

    def put(self, message: Message) -> None:
        """Sends a message."""
        self.messages.put(DEFAULT.encode(Frame(message)))

    def report(self, stamp: float, valid: Valid = USUAL) -> None:
        """Reports a pose at a time of the controller [s]."""
        self.put(JointFeedback(valid=valid, time=stamp, positions=(0.0, 0.0), velocities=(), accelerations=()))


def torque(stamp: float, valid: Valid) -> TorqueFeedback:
    """A message with an effort at a time of the controller [s]."""
    zero = (0.0, 0.0)
    return TorqueFeedback(
        valid=valid, time=stamp, positions=zero, velocities=zero, accelerations=zero, efforts=(1.0, 2.0)
    )


@pytest.fixture
def link() -> _Feedback:
    """A link without messages."""
    return _Feedback()


@pytest.fixture
def recorder(link: _Feedback, robot: Robot) -> Iterator[Recorder]:
    """A recorder at that link."""
    recorder = Recorder(link, robot, DEFAULT, PATIENCE, 20.0)
    yield recorder
    recorder.finish({})


def take_all(recorder: Recorder, count: int) -> None:
    """Waits until a number of messages was taken."""
    end = time.monotonic() + 10.0
    while recorder.received < count and time.monotonic() < end:
        time.sleep(0.01)


def repeated(recorder: Recorder, send: Callable[[], None], seconds: float) -> None:
    """Sends again and again, until the recording has ended or a time is over."""
    begin = time.monotonic()
    while recorder.error is None and time.monotonic() - begin < seconds:
        send()
        time.sleep(0.02)


def test_a_burst_of_late_messages_is_no_restart(link: _Feedback, recorder: Recorder) -> None:
    """Fifty messages of two seconds ago come at once, between newer ones: they count as late, and nothing ends."""
    for k in range(3):
        link.report(10.0 + k)
        for late in range(50):
            link.report(8.0 + k + 0.001 * late)
    link.report(13.0)
    take_all(recorder, 154)
    assert recorder.error is None
    assert (recorder.received, recorder.statistics.late, recorder.stamp) == (154, 150, 13.0)


@pytest.mark.parametrize("back", [0.2, 10.0])
def test_a_clock_that_goes_on_from_an_earlier_time_is_a_restart(
    link: _Feedback, recorder: Recorder, back: float
) -> None:
    """A controller that restarted reports earlier times and nothing else, also if it had run for a moment only."""
    link.report(10.0)
    begin = time.monotonic()
    repeated(recorder, lambda: link.report(10.0 - back + 0.001 * (time.monotonic() - begin)), 20 * BACKWARD_TIME)
    with pytest.raises(ControllerError, match=r"clock went back by .* restarted"):
        recorder.check()


@pytest.mark.parametrize(
    ("send", "reason"),
    [
        (lambda link: link.report(10.0), "its clock stands at 10 s"),
        (lambda link: link.put(STATUS), "its state arrives, but no positions"),
        (lambda link: link.report(11.0, Valid.TIME), "its messages do not state a valid position"),
        (lambda link: link.report(11.0, Valid.POSITION), "its messages do not state a valid time"),
        (lambda link: link.messages.put(b"no message"), "what comes is no message"),
    ],
)
def test_messages_that_make_no_row_end_the_recording_with_their_reason(
    link: _Feedback, recorder: Recorder, send: Callable[[_Feedback], None], reason: str
) -> None:
    """A clock that stands, a state alone, invalid fields and other bytes: after the patience that is no feedback."""
    link.report(10.0)
    take_all(recorder, 1)
    repeated(recorder, lambda: send(link), 2 * PATIENCE)
    with pytest.raises(LinkError, match=f"no feedback from a test for .* s: {reason}"):
        recorder.check()


def test_a_state_without_positions_is_said_at_the_beginning(link: _Feedback, recorder: Recorder) -> None:
    """The controller speaks simple_message; its program sends no positions."""
    recorder._connect_time = 0.3
    link.put(STATUS)
    with pytest.raises(ProtocolError, match="its state arrives, but no positions"):
        recorder.wait_for_feedback()


def test_an_effort_that_changes_its_meaning_is_not_recorded(
    link: _Feedback, recorder: Recorder, tmp_path: Path
) -> None:
    """Torques become currents, or invalid: no row says that they are torques."""
    every = USUAL | Valid.VELOCITY | Valid.TORQUE
    link.put(torque(1.0, every))
    recorder.wait_for_feedback()
    recorder.begin(tmp_path / "log.csv", {})
    link.put(torque(2.0, every))
    link.put(torque(3.0, USUAL | Valid.VELOCITY | Valid.CURRENT))
    link.put(torque(4.0, USUAL | Valid.VELOCITY))
    take_all(recorder, 4)
    assert recorder.statistics.rows == 1
    assert recorder._why_no_row() == "its messages do not state a valid torque"


def test_a_clock_too_coarse_for_its_reals_gives_times_of_arrival(
    link: _Feedback, recorder: Recorder, tmp_path: Path
) -> None:
    """After 11 h a real of 4 bytes counts in steps of 3.9 ms: all messages make rows, and the log says whose time."""
    step = float(np.spacing(np.float32(40000.0)))
    link.report(40000.0)
    recorder.wait_for_feedback()
    recorder.begin(tmp_path / "log.csv", {})
    for k in range(20):
        link.report(40000.0 + step * (k // 2))
    take_all(recorder, 21)
    recorder.finish({})
    assert recorder.rows == 20
    assert "clock is at 40000 s and counts in steps of 3.9 ms" in recorder.note
    assert "clock: arrival" in (tmp_path / "log.csv").read_text()

"""Feedback that comes late is left out, and a controller whose clock restarted is named."""

from __future__ import annotations

import queue
import time

import pytest

from oed.controllers import ControllerError
from oed.controllers.links import Link
from oed.controllers.recording.recorder import BACKWARD, Recorder
from oed.exports.simple_message import DEFAULT, Frame, JointFeedback, Valid
from robots.robot import Robot


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

    def report(self, stamp: float) -> None:
        """Reports a pose at a time of the controller [s]."""
        valid = Valid.TIME | Valid.POSITION
        message = JointFeedback(valid=valid, time=stamp, positions=(0.0, 0.0), velocities=(), accelerations=())
        self.messages.put(DEFAULT.encode(Frame(message)))


@pytest.fixture
def link() -> _Feedback:
    """A link without messages."""
    return _Feedback()


@pytest.fixture
def recorder(link: _Feedback, robot: Robot) -> Recorder:
    """A recorder at that link."""
    return Recorder(link, robot, DEFAULT, 10.0, 10.0)


def test_a_burst_of_late_messages_is_no_restart(link: _Feedback, recorder: Recorder) -> None:
    """Fifty messages of two seconds ago come at once, between newer ones: they count as late, and nothing ends."""
    for k in range(3):
        link.report(10.0 + k)
        for late in range(50):
            link.report(8.0 + k + 0.001 * late)
    link.report(13.0)
    end = time.monotonic() + 10.0
    while recorder.received < 154 and time.monotonic() < end:
        time.sleep(0.01)
    recorder.finish({})
    recorder.check()
    assert (recorder.received, recorder.statistics.late, recorder.stamp) == (154, 150, 13.0)


@pytest.mark.parametrize("back", [0.2, 10.0])
def test_a_clock_that_goes_on_from_an_earlier_time_is_a_restart(
    link: _Feedback, recorder: Recorder, back: float
) -> None:
    """A controller that restarted reports earlier times and nothing else, also if it had run for a moment only."""
    link.report(10.0)
    begin = time.monotonic()
    while recorder.error is None and time.monotonic() - begin < 20 * BACKWARD:
        link.report(10.0 - back + 0.001 * (time.monotonic() - begin))
        time.sleep(0.02)
    recorder.finish({})
    with pytest.raises(ControllerError, match=r"clock went back by .* restarted"):
        recorder.check()

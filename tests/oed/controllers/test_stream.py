"""A trajectory goes to the controller and comes back as a log."""

from __future__ import annotations

import re
import threading
import time
from pathlib import Path

import numpy as np
import pytest

from estimation import read_log
from oed.controllers import ControllerError, LinkError, StreamOptions, stream
from oed.exports.simple_message import WireFormat
from robots.plants import Sensors, nominal_plant, simulate
from robots.signals import Log, Motion
from tests.oed.controllers.conftest import swing

pytestmark = pytest.mark.slow

EXACT = Sensors(encoder_counts=0, torque_noise=0)
REAL = 2e-7
"""Rounding of a real of 4 bytes, relative."""


def moving_part(log: Log, motion: Motion) -> Log:
    """The rows of the log that belong to the trajectory: it begins one sample before the first that moves."""
    first = int(np.flatnonzero(np.abs(log.q - motion.q[0]).max(axis=1) > 1e-9)[0])
    start = first - int(np.flatnonzero(np.abs(motion.q - motion.q[0]).max(axis=1) > 1e-9)[0])
    return log.rows(slice(start, start + len(motion)))


@pytest.mark.parametrize("transport", ["udp", "tcp"])
@pytest.mark.parametrize("points", ["full", "short"])
def test_every_point_is_played_in_order(transport, points, robot, controllers, log: Path) -> None:
    """Positions of the log are those of the trajectory, all of them, once and in order, on the controller's clock."""
    motion = swing(robot)
    controller, endpoint = controllers(plant=nominal_plant(robot, sensors=EXACT), transport=transport)
    result = stream(motion, robot, endpoint, log=log, options=StreamOptions(points=points))
    assert (result.sent, result.stopped, controller.points) == (300, True, 300)
    read = read_log(log, robot.n)
    part = moving_part(read, motion)
    np.testing.assert_allclose(part.q, motion.q, rtol=REAL, atol=1e-7)
    np.testing.assert_allclose(np.diff(part.t), 0.004, atol=1e-9)
    assert read.metadata["robot"] == robot.name
    assert read.metadata["complete"] is True
    assert read.metadata["feedback"]["lost"] == 0
    assert 0 < read.metadata["message_delay"] < 0.5


def test_torque_is_that_of_the_virtual_robot(robot, controllers, log: Path) -> None:
    """Torque in the log is that of `oed simulate` for the same trajectory, computed piece by piece or not."""
    motion = swing(robot)
    plant = nominal_plant(robot, sensors=EXACT)
    _, endpoint = controllers(plant=plant)
    stream(motion, robot, endpoint, log=log)
    expected = simulate(plant, motion).tau
    assert expected is not None
    measured = moving_part(read_log(log, robot.n), motion).tau
    np.testing.assert_allclose(measured, expected, rtol=1e-6, atol=1e-5 * np.abs(expected).max())


@pytest.mark.parametrize("form", [WireFormat(byte_order="big", real_bytes=8)])
def test_other_formats(form: WireFormat, robot, controllers, log: Path) -> None:
    """With reals of 8 bytes positions are exact, in the other byte order too."""
    motion = swing(robot, 200, 0.2)
    _, endpoint = controllers(plant=nominal_plant(robot, sensors=EXACT), form=form)
    stream(motion, robot, endpoint, log=log)
    np.testing.assert_array_equal(moving_part(read_log(log, robot.n), motion).q, motion.q)


@pytest.mark.parametrize("transport", ["udp", "tcp"])
def test_download(transport, robot, controllers, log: Path) -> None:
    """A downloaded trajectory begins after its last point, and is played whole."""
    motion = swing(robot)
    controller, endpoint = controllers(transport=transport, plant=nominal_plant(robot, sensors=EXACT))
    result = stream(motion, robot, endpoint, log=log, options=StreamOptions(download=True))
    assert (result.sent, controller.points) == (300, 300)
    np.testing.assert_allclose(moving_part(read_log(log, robot.n), motion).q, motion.q, rtol=REAL, atol=1e-7)


def test_thesis_feedback(robot, controllers, log: Path) -> None:
    """A controller that sends positions only, and no status, gives a log with times of arrival."""
    motion = swing(robot)
    _, endpoint = controllers(feedback="position", status=False, handshake=0xFF, speed=2.0)
    stream(motion, robot, endpoint, log=log)
    read = read_log(log, robot.n, torque=False)
    assert (read.tau, read.dq, read.metadata["clock"], read.metadata["feedback"]["lost"]) == (
        None,
        None,
        "arrival",
        None,
    )
    assert np.abs(read.q).max() == pytest.approx(0.4, abs=1e-3)


def test_long_trajectory_under_faults(robot, controllers, log: Path) -> None:
    """5 % lost, 5 % doubled and 5 % late by 50 ms: with a window all points arrive, each once and in order."""
    motion = swing(robot, 600)
    controller, endpoint = controllers(
        plant=nominal_plant(robot, sensors=EXACT), lose=0.05, double=0.05, late=0.05, reorder=0.05, replies="echo"
    )
    result = stream(motion, robot, endpoint, log=log, options=StreamOptions(window=16))
    assert (result.sent, controller.points) == (600, 600)
    assert result.resent > 0
    read = read_log(log, robot.n)
    assert (np.diff(read.t) > 0).all()
    assert read.metadata["feedback"]["lost"] > 0
    # Feedback was lost, too: what is there fits the trajectory at its time.
    start = float(np.interp(0.2, read.q[: int(read.q[:, 0].argmax()), 0], read.t[: int(read.q[:, 0].argmax())]))
    planned = float(np.interp(0.2, motion.q[:300, 0], motion.t[:300]))
    rows = (read.t > start - planned) & (read.t < start - planned + motion.duration)
    expected = np.interp(read.t[rows] - start + planned, motion.t, motion.q[:, 0])
    np.testing.assert_allclose(read.q[rows, 0], expected, atol=2e-3)


def test_faults_without_sequence_numbers(robot, controllers, log: Path) -> None:
    """Replies without a body leave doubts: the points are played in order, or the stream ends with its reason."""
    motion = swing(robot, 300)
    controller, endpoint = controllers(lose=0.02, double=0.02, late=0.02, plant=nominal_plant(robot, sensors=EXACT))
    ended = ""
    try:
        stream(motion, robot, endpoint, log=log)
    except ControllerError as error:
        ended = str(error)
    assert controller.points == 300 if not ended else re.search("refuses point|reports the error", ended)
    q = read_log(log, robot.n).q[:, 0]
    assert (np.diff(q[: q.argmax()]) > -1e-6).all()


@pytest.mark.parametrize(
    ("settings", "problem"),
    [
        ({"silent_after": 150}, "silent|no reply"),
        ({"error_after": 150}, "error 1|refuses point"),
        ({"e_stop_after": 150}, "emergency stop|refuses point"),
        ({"restart_after": 150}, "restarted|silent|no reply"),
        ({"stuck": True}, "takes no points"),
        ({"restart_after": 150, "transport": "tcp"}, "closed the connection"),
        ({"speed": 20.0, "capacity": 4, "wait_for_points": False}, "error 2|refuses point"),
    ],
)
def test_what_goes_wrong_on_the_way(settings, problem: str, robot, controllers, log: Path) -> None:
    """Whatever ends the motion early is one message with its reason, and the log is whole up to there."""
    controller, endpoint = controllers(**settings)
    with pytest.raises((LinkError, ControllerError), match=problem) as caught:
        stream(swing(robot), robot, endpoint, log=log, options=StreamOptions(patience=1.5))
    assert f"rows are in {log}" in str(caught.value)
    read = read_log(log, robot.n)
    assert len(read) > 2
    assert read.metadata["complete"] is False
    assert not controller.player.moving


def test_controller_that_dies(robot, controllers, log: Path) -> None:
    """A controller that is killed in the middle ends the stream within the patience."""
    controller, endpoint = controllers(speed=1.0)
    threading.Timer(0.7, controller.stop).start()
    begin = time.monotonic()
    with pytest.raises(LinkError, match=r"silent|no reply"):
        stream(swing(robot, 600), robot, endpoint, log=log, options=StreamOptions(patience=0.6))
    assert time.monotonic() - begin < 0.7 + 0.6 + 2.0
    assert len(read_log(log, robot.n)) > 50


def test_two_trajectories_on_one_controller(robot, controllers, log: Path) -> None:
    """A controller plays one trajectory after the other."""
    motion = swing(robot, 200, 0.2)
    controller, endpoint = controllers()
    for _ in range(2):
        stream(motion, robot, endpoint, log=log, force=True)
    assert controller.points == 400

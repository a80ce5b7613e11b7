"""A trajectory goes to the controller and comes back as a log."""

from __future__ import annotations

import re
import threading
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from estimation import read_log
from oed.controllers import ControllerError, LinkError, StreamOptions, stream
from oed.exports import check_trajectory
from robots.plants import Sensors, nominal_plant, simulate
from robots.signals import Log, Motion
from tests.oed.controllers.conftest import PATIENT, PERIOD, swing

pytestmark = pytest.mark.slow

EXACT = Sensors(encoder_counts=0, torque_noise=0)
BUSY = 0.1
"""A busy computer is so late [s]."""

REAL = 2e-7
"""Rounding of a real of 4 bytes, relative."""


def samples_of(log: Log, motion: Motion, seen: float = 2e-6) -> tuple[Log, NDArray[np.intp]]:
    """The rows of the log that belong to the trajectory, and the samples of the trajectory that they are.

    Time stamps count samples, so rows that were lost on the way leave gaps and shift nothing. The first row that moved
    is one of the first samples; which one, its position says.

    Args:
        log: on the controller's clock.
        motion: the trajectory; its first joint moves one way at its beginning.
        seen: movement that a position shows for sure, above the rounding of its real [rad].
    """
    first = int(np.flatnonzero(np.abs(log.q[:, 0] - motion.q[0, 0]) > seen)[0])
    begin = motion.q[: len(motion) // 3, 0]
    sample = int(np.abs(begin - log.q[first, 0]).argmin())
    numbers = sample + np.rint((log.t - log.t[first]) / PERIOD).astype(np.intp)
    rows = np.flatnonzero((numbers >= 0) & (numbers < len(motion)))
    return log.rows(slice(int(rows[0]), int(rows[-1]) + 1)), numbers[rows]


@pytest.mark.parametrize("transport", ["udp", "tcp"])
@pytest.mark.parametrize("points", ["full", "short"])
def test_every_point_is_played_in_order(transport, points, robot, controllers, log: Path) -> None:
    """Positions of the log are those of the trajectory, all of them, once and in order, on the controller's clock."""
    motion = swing(robot)
    controller, endpoint = controllers(plant=nominal_plant(robot, sensors=EXACT), transport=transport)
    result = stream(motion, robot, endpoint, log=log, options=replace(PATIENT, points=points))
    assert (result.sent, result.stopped, controller.points) == (300, True, 300)
    read = read_log(log, robot.n)
    part, samples = samples_of(read, motion)
    np.testing.assert_allclose(part.q, motion.q[samples], rtol=REAL, atol=1e-7)
    np.testing.assert_allclose(np.diff(part.t), 0.004 * np.diff(samples), atol=1e-9)
    assert read.metadata["robot"] == robot.name
    assert read.metadata["complete"] is True
    # A busy computer may lose datagrams, and none by TCP. Each that is lost is counted.
    missing = np.rint(np.diff(read.t) / 0.004).astype(int).sum() - (len(read) - 1)
    assert read.metadata["feedback"]["lost"] == missing
    assert missing == 0 or transport == "udp"
    assert missing < 0.2 * len(read)
    assert 0 < read.metadata["message_delay"] < 0.5


def test_a_robot_that_never_moves_has_not_played(robot, controllers, log: Path) -> None:
    """A controller takes all points at once and does not move: the trajectory ends where it began, and is not done."""
    controller, endpoint = controllers(stuck=True, capacity=5000, status=False)
    with pytest.raises(ControllerError, match="the robot has not begun to move"):
        stream(swing(robot), robot, endpoint, log=log, options=StreamOptions(patience=1.0))
    assert (controller.points, controller.player.played_trajectories) == (300, 0)


def test_torque_is_that_of_the_virtual_robot(robot, controllers, log: Path) -> None:
    """Torque in the log is that of `oed simulate` for the same trajectory, computed piece by piece or not."""
    motion = swing(robot)
    plant = nominal_plant(robot, sensors=EXACT)
    _, endpoint = controllers(plant=plant)
    stream(motion, robot, endpoint, log=log, options=PATIENT)
    expected = simulate(plant, motion).tau
    assert expected is not None
    part, samples = samples_of(read_log(log, robot.n), motion)
    assert len(samples) > 0.8 * len(motion)
    assert part.tau is not None
    np.testing.assert_allclose(part.tau, expected[samples], rtol=1e-6, atol=1e-5 * np.abs(expected).max())


def test_other_formats(robot, controllers, log: Path) -> None:
    """With reals of 8 bytes positions are exact, in the other byte order too."""
    motion = swing(robot, 200, 0.2)
    _, endpoint = controllers(plant=nominal_plant(robot, sensors=EXACT), byte_order="big", real_bytes=8)
    stream(motion, robot, endpoint, log=log, options=PATIENT)
    part, samples = samples_of(read_log(log, robot.n), motion)
    assert len(samples) > 0.8 * len(motion)
    np.testing.assert_array_equal(part.q, motion.q[samples])


@pytest.mark.parametrize("transport", ["udp", "tcp"])
def test_download(transport, robot, controllers, log: Path) -> None:
    """A downloaded trajectory begins after its last point, and is played whole."""
    motion = swing(robot)
    controller, endpoint = controllers(transport=transport, plant=nominal_plant(robot, sensors=EXACT))
    result = stream(motion, robot, endpoint, log=log, options=replace(PATIENT, download=True))
    assert (result.sent, controller.points) == (300, 300)
    part, samples = samples_of(read_log(log, robot.n), motion)
    assert len(samples) > 0.8 * len(motion)
    np.testing.assert_allclose(part.q, motion.q[samples], rtol=REAL, atol=1e-7)


def test_thesis_feedback(robot, controllers, log: Path) -> None:
    """A controller that sends positions only, and no status, gives a log with times of arrival."""
    motion = swing(robot)
    _, endpoint = controllers(feedback="position", status=False, handshake=0xFF, speed=2.0)
    stream(motion, robot, endpoint, log=log, options=replace(PATIENT, ping=True, speed=2.0))
    read = read_log(log, robot.n, torque=False)
    # Times are those of the measurement: of the arrival less half the round trip of a ping.
    assert 0 < read.metadata["delay_removed"] < 1.0
    assert "clock_offset" not in read.metadata
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
    result = stream(motion, robot, endpoint, log=log, options=replace(PATIENT, window=16))
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
        stream(motion, robot, endpoint, log=log, options=PATIENT)
    except ControllerError as error:
        ended = str(error)
    assert controller.points == 300 if not ended else re.search("refuses point|reports the error", ended)
    q = read_log(log, robot.n).q[:, 0]
    assert (np.diff(q[: q.argmax()]) > -1e-6).all()


@pytest.mark.parametrize(
    ("settings", "problem"),
    [
        ({"silent_after": 150}, "silent|no reply"),
        ({"error_after": 150}, "the controller reports the error 1 after point"),
        ({"e_stop_after": 150}, "the controller reports an emergency stop after point .*clear it at the controller"),
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
    check_trajectory(swing(robot, 600), robot)  # compiles the torque model, which takes its time once
    threading.Timer(0.7, controller.stop).start()
    begin = time.monotonic()
    with pytest.raises(LinkError, match=r"silent|no reply"):
        stream(swing(robot, 600), robot, endpoint, log=log, options=StreamOptions(patience=0.6))
    assert time.monotonic() - begin < 0.7 + 0.6 + 2.0
    assert len(read_log(log, robot.n)) > 50


@pytest.mark.parametrize("feedback", ["full", "position"])
@pytest.mark.parametrize("fault", ["swap", "sign", "half-speed", "stall", "offset", "other-robot"])
def test_faults_of_the_path(fault, feedback, robot, controllers, log: Path) -> None:
    """A robot that leaves its plan is stopped within 0.2 s of leaving the tolerance, with joint, time and positions."""
    motion = swing(robot, 600, 0.6)
    after = 0.4
    controller, endpoint = controllers(
        path=fault,
        path_after=after,
        feedback=feedback,
        replies="echo",
        speed=1.0,
        late=0.05,
        late_by=0.05,
        wait_for_points=False,
    )
    message = r"joint \d: the robot has left the plan: at \d\.\d+ s of the trajectory it is at .* the plan is .* rad"
    with pytest.raises(ControllerError, match=message):
        stream(motion, robot, endpoint, log=log, options=replace(PATIENT, window=32))
    assert not controller.player.moving
    read = read_log(log, robot.n, torque=False)
    assert read.metadata["complete"] is False
    assert "left the plan" in read.metadata["ended"]
    if feedback == "full":
        part, samples = samples_of(read, motion)
        left = part.t[(np.abs(part.q - motion.q[samples]).max(axis=1) > 0.05).argmax()]
        assert 0.05 <= read.t[-1] - left < 0.2 + BUSY


def test_two_trajectories_on_one_controller(robot, controllers, log: Path) -> None:
    """A controller plays one trajectory after the other."""
    motion = swing(robot, 200, 0.2)
    controller, endpoint = controllers()
    for _ in range(2):
        stream(motion, robot, endpoint, log=log, options=PATIENT, force=True)
    assert controller.points == 400

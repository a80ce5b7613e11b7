"""Trajectories on the UR controller to test against, which runs the programs that it is sent."""

from __future__ import annotations

import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from estimation import read_log
from oed.controllers import (
    ControllerError,
    ControllerOptions,
    Endpoint,
    Faults,
    StreamOptions,
    driver_of,
    record,
    stream,
    virtual_controller,
)
from oed.controllers.errors import LinkError, ProtocolError
from oed.controllers.virtual.ur.controller import VirtualUr
from oed.controllers.virtual.ur.script import ScriptError, program_of, run_program
from oed.exports import export_trajectory
from oed.exports.forms.sampling import at_cycle
from robots.common.errors import InputError
from robots.loading import load_robot
from robots.robot import Robot
from tests.oed.controllers.conftest import swing

UR = driver_of("ur")
PATIENT = StreamOptions.of(UR, patience=20.0)
PERIODS = pytest.mark.parametrize("cycle", [0.008, 0.002])


@pytest.fixture(scope="module")
def ur10() -> Robot:
    """Load a UR10, whose controller is a CB."""
    return load_robot("ur10")


@contextmanager
def playing(robot: Robot, pose: Any = None, **settings: Any) -> Iterator[tuple[VirtualUr, Endpoint]]:
    """Start a controller on free ports."""
    faults = Faults(**{name: settings.pop(name) for name in list(settings) if name in Faults.__dataclass_fields__})
    settings = {"motion_port": 0, "state_port": 0, "wait_for_points": True} | settings
    options = ControllerOptions.of(UR, faults=faults, **settings)
    controller = virtual_controller(robot, options=options, pose=pose)
    assert isinstance(controller, VirtualUr)
    with controller:
        ports = {"motion_port": controller.motion_port, "state_port": controller.state_port}
        yield controller, Endpoint.of(UR, "127.0.0.1", connect_time=10.0, **ports)


@pytest.mark.slow
@PERIODS
def test_played_and_recorded(cycle: float, ur10: Robot, log: Path) -> None:
    """The log has the trajectory after the lag of the arm, which is measured to a cycle, and what identify needs."""
    robot = replace(ur10, period=cycle)
    motion = swing(robot, 500)
    with playing(robot, speed=4.0) as (controller, place):
        result = stream(motion, robot, place, log=log, options=replace(PATIENT, speed=4.0))
        assert stream(motion, robot, place, log=log, options=replace(PATIENT, speed=4.0), force=True).stopped
    assert controller.programs == 2
    assert (result.sent, result.stopped, controller.said) == (result.points, True, [])
    read = read_log(log, 6)
    assert read.metadata["ended"] == "done"
    assert read.metadata["feedback"]["lost"] == 0
    np.testing.assert_allclose(np.diff(read.t), cycle, atol=1e-9)
    np.testing.assert_allclose(read.metadata["command_lag"], controller.lag, atol=0.002)
    assert "behind the commands" in result.summary()
    # One position a point, from some row on; the encoders of the plant round to 4.8e-5 rad.
    played = at_cycle(motion, cycle)
    step = round((played.period or 0.0) / cycle)
    rows = [read.q[first::step][: len(played)] for first in range(len(read) - step * (len(played) - 1))]
    assert min(float(np.abs(q - played.q).max()) for q in rows) < 2.5e-5
    assert (read.tau is None) == (cycle == 0.008)
    assert np.ptp(read.temperature) == 0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"e_stop_after": 30}, "the controller reports an emergency stop after point"),
        ({"error_after": 30}, r"reports safety mode 3 \(protective stop\) after point"),
        ({"silent_after": 30}, "is silent for"),
        ({"restart_after": 30}, "closed the connection"),
        ({"stuck": True}, "does not connect to 127.0.0.1.*remote control"),
        ({"path": "swap", "path_after": 0.5}, "the robot has left the plan"),
        ({"state": "drives-off"}, "reports drives without power"),
        ({"state": "e-stop"}, "reports an emergency stop"),
    ],
)
def test_what_ends_a_motion(settings: dict[str, Any], words: str, ur10: Robot, log: Path, monkeypatch: Any) -> None:
    """Each fault ends the command with one message; the robot stands, and the log is whole up to then."""
    monkeypatch.setattr("oed.controllers.clients.program.CONNECT_TIMEOUT", 0.5)
    motion = swing(ur10, 750)
    with playing(ur10, **settings) as (controller, place):
        with pytest.raises((ControllerError, LinkError), match=words):
            stream(motion, ur10, place, log=log, options=replace(PATIENT, patience=1.0))
        time.sleep(0.5)
        assert not controller.moving
        assert np.abs(controller._arm.speed).max() == 0
    if log.exists():
        read = read_log(log, 6)
        assert read.metadata["complete"] is False
        assert np.isfinite(read.q).all()


@pytest.mark.slow
def test_a_running_program_is_another_client(ur10: Robot, log: Path) -> None:
    """A controller that runs a program gets none; without that program it plays."""
    motion = swing(ur10, 500)
    hold = 'def other():\n  popup("wait", blocking=True)\nend\n'
    with playing(ur10, speed=4.0) as (controller, place):
        with socket.create_connection(("127.0.0.1", controller.motion_port)) as client:
            client.sendall(hold.encode())
            while not controller.moving:
                time.sleep(0.01)
            with pytest.raises(ControllerError, match="another client may be playing it"):
                stream(motion, ur10, place, log=log, options=PATIENT)
        assert controller.said == ["wait"]
        record(ur10, place, log, duration=0.1)


@pytest.mark.slow
def test_programs_check_the_start_themselves(ur10: Robot, log: Path, tmp_path: Path) -> None:
    """An exported program plays from its start, and ends before any command elsewhere."""
    motion = swing(ur10, 500)
    export_trajectory(tmp_path / "p.script", motion, ur10, "urscript")
    program = (tmp_path / "p.script").read_bytes()
    for pose, plays in ((motion.q[0], True), (motion.q[0] + 0.1, False)):
        with playing(ur10, pose, speed=4.0) as (controller, place):
            threading.Timer(0.2, lambda port=controller.motion_port: send(port, program)).start()
            record(ur10, place, log, duration=1.2, force=True)
        q = read_log(log, 6).q
        if plays:
            np.testing.assert_allclose(q.max(axis=0), motion.q.max(axis=0), atol=1e-4)
            np.testing.assert_allclose(q[-1], motion.q[-1], atol=1e-6)
            assert controller.programs == 1
        else:
            assert np.ptp(q, axis=0).max() == 0
            assert controller.said == ["The robot is not at the start of the trajectory."]
            assert controller.points == 0


def send(port: int, program: bytes) -> None:
    """Send a program as a person does with a socket."""
    with socket.create_connection(("127.0.0.1", port)) as client:
        client.sendall(program)


@pytest.mark.slow
def test_wrong_profiles(ur10: Robot, log: Path) -> None:
    """A UR controller taken for another driver's, and the other way round, is one message and no log."""
    motion = swing(ur10, 500)
    with playing(ur10) as (_, place):
        wrong = Endpoint.of(
            driver_of("generic"), "127.0.0.1", motion_port=9, state_port=place.state_port, connect_time=0.5
        )
        with pytest.raises(ProtocolError, match=r"no feedback|speaks another protocol"):
            stream(motion, ur10, wrong, log=log)
    options = ControllerOptions.of(driver_of("generic"), motion_port=0, state_port=0)
    with virtual_controller(ur10, options=options) as other:
        wrong = Endpoint.of(
            UR, "127.0.0.1", motion_port=other.motion_port, state_port=other.state_port, connect_time=1.0
        )
        with pytest.raises(LinkError, match=r"RTDE|closed the connection"):
            stream(motion, ur10, wrong, log=log, options=PATIENT)
    assert not log.exists()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("def f():\n  while True:\n    sync()\n  end\n", "without end"),
        ("def f():\n  import os\nend\n", "Import is not known"),
        ("def f():\n  x = y.z\nend\n", "Attribute is not known"),
        ("def f():\nservoj(1)\nend\n", "wrong indentation"),
        ("x = 1\n", "one function"),
        ("def f():\n  x = (1\nend\n", "never closed"),
    ],
)
def test_programs_that_are_none(text: str, words: str) -> None:
    """What is no program of the known part of URScript is refused."""
    with pytest.raises(ScriptError, match=words):
        program_of(text)
    with pytest.raises(ScriptError, match="the command print is not known"):
        run_program(program_of("def f():\n  print(1)\nend\n"), {})


def test_robots_without_six_joints() -> None:
    """The controller to test against has six joints."""
    with pytest.raises(InputError, match="allowed: 6"):
        virtual_controller(load_robot("panda"), options=ControllerOptions.of(UR, motion_port=0, state_port=0))


KILLED = """
import os, sys, threading, time
from oed.controllers import Endpoint, StreamOptions, driver_of, stream
from robots.loading import load_robot
from tests.oed.controllers.conftest import swing

driver, robot = driver_of("ur"), load_robot("ur10")
threading.Timer(1.5, os._exit, [9]).start()
ports = dict(zip(("motion_port", "state_port"), map(int, sys.argv[2:])))
place = Endpoint.of(driver, "127.0.0.1", **ports)
stream(swing(robot, 1500), robot, place, log=sys.argv[1], options=StreamOptions.of(driver))
"""


@pytest.mark.slow
def test_a_killed_client_leaves_a_robot_that_stops(ur10: Robot, log: Path) -> None:
    """The program on the controller stops the robot once no point comes, within the points that it has and 0.1 s."""
    with playing(ur10, wait_for_points=False) as (controller, place):
        words = ["-W", "ignore", "-c", KILLED, str(log), str(place.motion_port), str(place.state_port)]
        client = subprocess.Popen([sys.executable, *words])
        while not controller.points:
            assert client.poll() is None
            time.sleep(0.01)
        assert client.wait(timeout=60) == 9
        killed = time.monotonic()
        while controller.moving or np.abs(controller._arm.speed).max() > 0:
            assert time.monotonic() - killed < 2.0
            time.sleep(0.01)
        # Points of 0.2 s, 0.1 s without any, and the way to rest.
        assert time.monotonic() - killed < 0.8
        assert 0 < controller.points < 750

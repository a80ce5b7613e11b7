"""The commands around a controller, in processes of their own as a user starts them."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from estimation import read_log
from oed.controllers import ControllerOptions, Faults, VirtualController
from oed.controllers.drivers import driver_of
from oed.exports import write_trajectory
from oed.retiming import plan_move
from oed.trajectories import PiecewisePolynomial
from robots.loading import load_robot
from tests.oed.controllers.conftest import swing

pytestmark = pytest.mark.slow


def start(*arguments: object) -> subprocess.Popen[str]:
    """Start a command."""
    words = [sys.executable, "-W", "ignore", "-m", "oed", *map(str, arguments)]
    return subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


@pytest.mark.parametrize("order", [signal.SIGINT, signal.SIGHUP])
def test_interrupted_stream(order: signal.Signals, robot: Path, run, tmp_path: Path) -> None:
    """Ctrl-C or a lost terminal stops the robot and keeps what was recorded; the next client is served at once."""
    described = load_robot(robot)
    write_trajectory(tmp_path / "trajectory.csv", swing(described, 1500))
    options = ControllerOptions(motion_port=0, state_port=0)
    with VirtualController(described, options=options) as controller:
        place = ["--host", "127.0.0.1", "--state-port", controller.state_port]
        line = ["stream", tmp_path / "trajectory.csv", "--robot", robot, "--motion-port", controller.motion_port]
        process = start(*line, *place, "--log", tmp_path / "log.csv", "--patience", "20")
        while not (tmp_path / "log.csv").exists() or (tmp_path / "log.csv").stat().st_size < 20_000:
            assert process.poll() is None
            time.sleep(0.01)
        process.send_signal(order)
        _, err = process.communicate(timeout=120)
        assert process.returncode == 130
        assert [line[:4] for line in err.splitlines() if not line.startswith("note")] == ["oed:"]
        assert "the robot was ordered to stop" in err
        # Without a stop the controller would have run out of points, which is an error.
        assert (controller.player.moving, controller.player.error) == (False, 0)
        recorded = read_log(tmp_path / "log.csv", 2)
        assert len(recorded) > 50
        assert recorded.metadata["ended"] == "interrupted"

        second = ["--log", tmp_path / "second.csv", "--duration", 1.0, "--json"]
        done = run("record", "--robot", robot, *place, *second)
        assert done.code == 0, done.err
        assert done.data["rows"] == len(read_log(tmp_path / "second.csv", 2)) > 20


@contextmanager
def serving(robot: Path, transport: str) -> Iterator[tuple[subprocess.Popen[str], list[object]]]:
    """Start ``oed controller``, and give the options of its clients."""
    process = start("controller", "--robot", robot, "--transport", transport, "--motion-port", 0, "--state-port", 0)
    assert process.stderr is not None
    try:
        ports = None
        while ports is None:
            line = process.stderr.readline()
            assert line, "the controller has ended"
            ports = re.search(r"motion port (\d+), state port (\d+)", line)
        place = ["--host", "127.0.0.1", "--transport", transport, "--patience", 20]
        yield process, [*place, "--motion-port", ports[1], "--state-port", ports[2]]
    finally:
        process.kill()


@pytest.mark.parametrize("transport", ["udp", "tcp"])
def test_two_clients_at_once(transport: str, robot: Path, tmp_path: Path) -> None:
    """Of two programs that play at once, one plays to its end, and the other is refused with one message."""
    write_trajectory(tmp_path / "trajectory.csv", swing(load_robot(robot), 1000))
    with serving(robot, transport) as (controller, place):
        line = ["stream", tmp_path / "trajectory.csv", "--robot", robot, *place]
        clients = [start(*line, "--log", tmp_path / f"log_{number}.csv") for number in (1, 2)]
        errors = [client.communicate(timeout=120)[1] for client in clients]
        controller.terminate()
        out, _ = controller.communicate(timeout=60)
    codes = [client.returncode for client in clients]
    assert sorted(codes) == [0, 1], errors
    first = codes.index(0)
    refused = [text for text in errors[1 - first].splitlines() if not text.startswith(("note", "progress"))]
    assert len(refused) == 1
    assert re.fullmatch("oed: .*another client.*", refused[0])
    assert not (tmp_path / f"log_{2 - first}.csv").exists()
    log = read_log(tmp_path / f"log_{first + 1}.csv", 2)
    assert log.metadata["complete"] is True
    assert log.metadata["sent_points"] == 1000
    assert log.q[:, 0].max() == pytest.approx(0.4, abs=1e-3)
    assert out.startswith("1000 points received, 1 trajectories played")


def test_killed_recording(robot: Path, tmp_path: Path) -> None:
    """A recording that is killed is whole but for the last second."""
    options = ControllerOptions(motion_port=0, state_port=0, transport="tcp")
    path = tmp_path / "log.csv"
    with VirtualController(load_robot(robot), options=options) as controller:
        place = ["--host", "127.0.0.1", "--transport", "tcp", "--state-port", controller.state_port]
        process = start("record", "--robot", robot, *place, "--log", path)
        while not path.exists() or path.stat().st_size < 40_000:
            assert process.poll() is None
            time.sleep(0.05)
        process.kill()
        now = controller.time
        process.communicate(timeout=60)
    log = read_log(path, 2)
    assert log.metadata["complete"] is False
    np.testing.assert_allclose(np.diff(log.t), 0.004, atol=1e-6)
    assert now - 1.0 < log.t[-1] <= now + 0.1


def test_controller_ends_on_demand(robot: Path, run) -> None:
    """An order to terminate ends the controller with its summary and exit code 0; its ports are printed first."""

    def terminate() -> None:
        usual = signal.getsignal(signal.SIGTERM)
        while signal.getsignal(signal.SIGTERM) == usual:
            time.sleep(0.01)
        os.kill(os.getpid(), signal.SIGTERM)

    threading.Thread(target=terminate).start()
    done = run("controller", "--robot", robot, "--motion-port", 0, "--state-port", 0, "--json")
    assert done.code == 0
    assert re.search(r"motion port \d+, state port \d+", done.err)
    assert (done.data["points"], done.data["malformed"]) == (0, 0)


@pytest.mark.parametrize(
    ("arguments", "problem"),
    [
        (["stream", "T", "--host", "127.0.0.1", "--transport", "serial"], "transport"),
        (["stream", "T", "--host", "127.0.0.1", "--handshake", "x"], "--handshake x"),
        (["stream", "T", "--host", "127.0.0.1", "--byte-order", "middle"], "byte order"),
        (["stream", "T", "--host", "127.0.0.1", "--robot", "er3a"], "has 2 joints, er3a has 6"),
        (["stream", "T", "--host", "no.such.host.invalid", "--robot", "ROBOT"], "has no address"),
        (["stream", "T", "--host", "", "--robot", "ROBOT"], "the host is empty"),
        (["record", "--robot", "ROBOT", "--host", "127.0.0.1", "--duration", "-1"], "duration"),
        (
            ["stream", "T", "--host", "127.0.0.1", "--robot", "ROBOT", "--driver", "kuka"],
            "'kuka' is not known",
        ),
        (["stream", "T", "--host", "127.0.0.1", "--robot", "ROBOT", "--driver", "fanuc", "--ping"], "leave out --ping"),
        (["stream", "T", "--host", "127.0.0.1", "--robot", "ROBOT", "--driver", "abb", "--points", "full"], "misreads"),
        (["stream", "T", "--host", "127.0.0.1", "--robot", "ROBOT", "--tolerance", "1,2,3"], "3 tolerances"),
        (["controller", "--robot", "ROBOT", "--path-fault", "drop"], "path fault"),
        (["controller", "--robot", "ROBOT", "--speed", "0"], "speed"),
        (["controller", "--robot", "ROBOT", "--pose", "1"], "pose of 1"),
        (["controller", "--robot", "ROBOT", "--lose", "2"], "lose"),
    ],
)
def test_wrong_options(arguments: list[str], problem: str, run, robot: Path, tmp_path: Path) -> None:
    """A wrong option is one message with exit code 2."""
    write_trajectory(tmp_path / "t.csv", swing(load_robot(robot)))
    names = {"T": tmp_path / "t.csv", "ROBOT": robot}
    done = run(*(names.get(word, word) for word in arguments), "--quiet")
    assert done.code == 2
    assert problem in done.err
    assert "Traceback" not in done.err


@pytest.mark.parametrize(
    ("settings", "code", "problem"),
    [
        ({"pose": np.array([0.3, 0.0])}, 2, "joint 1: the robot is at 0.3, the trajectory begins at 0"),
        ({"stuck": True}, 1, "takes no points: no reply to point 100 .* its buffer does not empty"),
    ],
)
def test_controllers_that_do_not_play(settings: Any, code: int, problem: str, run, robot: Path, tmp_path: Path) -> None:
    """A robot that stands elsewhere, and a buffer that never empties: one message each, and no motion."""
    described = load_robot(robot)
    write_trajectory(tmp_path / "t.csv", swing(described))
    faults = Faults(stuck=settings.pop("stuck", False))
    options = ControllerOptions(motion_port=0, state_port=0, transport="tcp", faults=faults)
    with VirtualController(described, options=options, **settings) as controller:
        pose = controller.player.pose
        place = ["--host", "127.0.0.1", "--transport", "tcp", "--patience", 0.5]
        ports = ["--motion-port", controller.motion_port, "--state-port", controller.state_port]
        log = tmp_path / "log.csv"
        done = run("stream", tmp_path / "t.csv", "--robot", robot, *place, *ports, "--log", log, "--quiet")
        assert done.code == code
        assert re.fullmatch(f"oed: .*{problem}.*\n", done.err)
        np.testing.assert_array_equal(controller.player.pose, pose)
        assert not controller.player.moving
    assert log.exists() == (code == 1)
    if code == 1:
        assert f"{len(read_log(log, 2))} rows are in" in done.err


def test_another_period(run, robot: Path, tmp_path: Path) -> None:
    """A trajectory of 300 points fits into ABB's driver with a longer time between its points."""
    described = load_robot(robot)
    write_trajectory(tmp_path / "t.csv", swing(described))
    options = ControllerOptions.of(driver_of("abb"), motion_port=0, state_port=0)
    with VirtualController(described, options=options) as controller:
        ports = ["--motion-port", controller.motion_port, "--state-port", controller.state_port]
        line = ["stream", tmp_path / "t.csv", "--robot", robot, "--host", "127.0.0.1", "--driver", "abb", *ports]
        log = ["--log", tmp_path / "log.csv", "--json"]
        done = run(*line, *log)
        assert done.code == 2
        assert "300 points; allowed: up to 100, as ABB's driver holds" in done.err
        done = run(*line, *log, "--period", 0.02)
        assert done.code == 0, done.err
        assert done.data["sent"] == controller.points == 61


@pytest.mark.parametrize("driver", ["fanuc", "motoman"])
def test_commands_with_a_driver(driver: str, run, robot: Path, tmp_path: Path) -> None:
    """With --driver the ports and forms need no options, but those that are stated count."""
    described = load_robot(robot)
    write_trajectory(tmp_path / "t.csv", swing(described))
    options = ControllerOptions.of(driver_of(driver), motion_port=0, state_port=0)
    with VirtualController(described, options=options) as controller:
        ports = ["--motion-port", controller.motion_port, "--state-port", controller.state_port]
        line = ["--robot", robot, "--host", "127.0.0.1", "--driver", driver]
        done = run("stream", tmp_path / "t.csv", *line, *ports, "--log", tmp_path / "log.csv", "--json")
        assert done.code == 0, done.err
        assert (done.data["sent"], done.data["stopped"]) == (300, True)
        done = run("record", *line, *ports[2:], "--log", tmp_path / "second.csv", "--duration", 0.3, "--json")
        assert done.code == 0, done.err
        assert done.data["rows"] > 3


def test_a_trajectory_into_the_floor_is_not_played(run, tmp_path: Path) -> None:
    """A motion whose flange goes 160 mm below the base is refused before anything is sent, unless the user says so."""
    er3a = load_robot("er3a")
    planned = plan_move(er3a.limits, np.zeros(6), np.array([0.0, -2.0, 0.0, 0.0, 0.0, 0.0]), period=er3a.period)
    there = PiecewisePolynomial(breakpoints=planned.breakpoints, coefficients=planned.coefficients)
    write_trajectory(tmp_path / "down.csv", there.motion(er3a.period), {"robot": "er3a"})
    nowhere = ["--host", "127.0.0.1", "--transport", "tcp", "--motion-port", 9, "--state-port", 9]
    refused = run("stream", tmp_path / "down.csv", *nowhere, "--log", tmp_path / "log.csv")
    assert refused.code == 1
    assert "COLLIDES: floor / " in refused.err
    assert "--no-collision" in refused.err
    assert not (tmp_path / "log.csv").exists()
    # With other surroundings, or by the user's word, the next obstacle is that nothing listens.
    for option in (["--floor", -1.0], ["--no-floor"], ["--no-collision"]):
        tried = run("stream", tmp_path / "down.csv", *nowhere, *option, "--log", tmp_path / "log.csv")
        assert tried.code == 1
        assert "COLLIDES" not in tried.err
        assert "9" in tried.err

"""The commands around a controller, in processes of their own as a user starts them."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from estimation import read_log
from oed.controllers import ControllerOptions, VirtualController
from oed.exports import write_trajectory
from robots.loading import load_robot
from tests.oed.controllers.conftest import swing

pytestmark = pytest.mark.slow


def start(*arguments: object) -> subprocess.Popen[str]:
    """Start a command."""
    words = [sys.executable, "-W", "ignore", "-m", "oed", *map(str, arguments)]
    return subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def test_interrupted_stream(robot: Path, run, tmp_path: Path) -> None:
    """Ctrl-C stops the robot and keeps what was recorded; the controller is free for the next client at once."""
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
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=120)
        assert process.returncode == 130
        assert [line[:4] for line in err.splitlines() if not line.startswith("note")] == ["oed:"]
        assert "the robot was ordered to stop" in err
        assert not controller.player.moving
        assert len(read_log(tmp_path / "log.csv", 2)) > 50

        second = ["--log", tmp_path / "second.csv", "--duration", 0.3, "--json"]
        done = run("record", "--robot", robot, *place, *second)
        assert done.code == 0, done.err
        assert done.data["rows"] == len(read_log(tmp_path / "second.csv", 2)) > 20


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
        (["record", "--robot", "ROBOT", "--host", "127.0.0.1", "--duration", "-1"], "duration"),
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

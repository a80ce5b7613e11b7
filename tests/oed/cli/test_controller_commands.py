"""The commands around a controller, in processes of their own as a user starts them."""

from __future__ import annotations

import json
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from estimation import read_log
from oed.exports import write_trajectory
from robots.loading import load_robot
from tests.oed.controllers.conftest import swing

pytestmark = pytest.mark.slow


def start(*arguments: object) -> subprocess.Popen[str]:
    """Start a command."""
    words = [sys.executable, "-W", "ignore", "-m", "oed", *map(str, arguments)]
    return subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


@pytest.fixture
def controller(robot: Path) -> Iterator[tuple[str, str]]:
    """Start a controller at free ports; give their numbers."""
    process = start("controller", "--robot", robot, "--motion-port", 0, "--state-port", 0, "--json")
    assert process.stderr is not None
    ports = None
    while ports is None:
        line = process.stderr.readline()
        assert line, "the controller ended"
        ports = re.search(r"motion port (\d+), state port (\d+)", line)
    yield ports[1], ports[2]
    process.send_signal(signal.SIGTERM)
    out, _ = process.communicate(timeout=120)
    assert process.returncode == 0
    assert json.loads(out)["malformed"] == 0


def test_interrupted_stream(robot: Path, controller, tmp_path: Path) -> None:
    """Ctrl-C stops the robot and keeps what was recorded; the controller is free for the next client at once."""
    described = load_robot(robot)
    write_trajectory(tmp_path / "trajectory.csv", swing(described, 1500))
    place = ["--host", "127.0.0.1", "--state-port", controller[1]]
    line = ["stream", tmp_path / "trajectory.csv", "--robot", robot, "--motion-port", controller[0], *place]
    process = start(*line, "--log", tmp_path / "log.csv")
    while not (tmp_path / "log.csv").exists() or (tmp_path / "log.csv").stat().st_size < 20_000:
        assert process.poll() is None
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=120)
    assert process.returncode == 130
    assert [line[:4] for line in err.splitlines() if not line.startswith("note")] == ["oed:"]
    assert "the robot was ordered to stop" in err
    assert len(read_log(tmp_path / "log.csv", 2)) > 50

    done = start("record", "--robot", robot, *place, "--log", tmp_path / "second.csv", "--duration", 0.3, "--json")
    out, err = done.communicate(timeout=120)
    assert done.returncode == 0, err
    assert json.loads(out)["rows"] == len(read_log(tmp_path / "second.csv", 2)) > 20


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

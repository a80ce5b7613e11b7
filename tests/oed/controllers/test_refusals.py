"""What is refused before anything moves, each with one message."""

from __future__ import annotations

import socket
import socketserver
import threading
from contextlib import suppress
from dataclasses import replace
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import numpy as np
import pytest

from estimation import read_log
from oed.controllers import (
    ControllerError,
    ControllerOptions,
    Endpoint,
    Faults,
    LinkError,
    StreamOptions,
    VirtualController,
    record,
    stream,
)
from oed.controllers.errors import ProtocolError
from robots.common.errors import InputError
from robots.signals import Motion
from tests.oed.controllers.conftest import PATIENT, swing

SHORT = StreamOptions(patience=0.4)
NOWHERE = Endpoint(host="127.0.0.1", motion_port=9, state_port=9, connect_time=0.2, handshake_interval=0.1)


@pytest.mark.parametrize(
    ("change", "problem"),
    [
        (lambda m: Motion(m.t, 6 * m.q, 6 * m.dq, 6 * m.ddq), "joint 1: upper 2.4"),
        (lambda m: Motion(m.t / 3, m.q, 3 * m.dq, 9 * m.ddq), "velocity"),
        (lambda m: m.slice(40, None), "begins with a speed"),
        (lambda m: m.slice(None, 200), "ends with a speed"),
        (lambda m: Motion(m.t, m.q[:, :1], m.dq[:, :1], m.ddq[:, :1]), "has 1 joints"),
    ],
)
def test_trajectories_that_do_not_fit(change, problem: str, robot, log: Path) -> None:
    """A trajectory beyond a limit, in motion at an end, or of another robot is refused before anything is opened."""
    with pytest.raises(InputError, match=problem):
        stream(change(swing(robot)), robot, NOWHERE, log=log, file="trajectory.csv")
    assert not log.exists()


def test_trajectory_of_another_robot(robot, log: Path) -> None:
    """The robot that the file names must be the robot that is given."""
    with pytest.raises(InputError, match="of the robot er3a, not of two"):
        stream(swing(robot), robot, NOWHERE, log=log, metadata={"robot": "er3a"})


def test_logs_that_cannot_be_written(robot, tmp_path: Path) -> None:
    """A log that exists, is no CSV or has no folder is refused before anything moves."""
    there = tmp_path / "there.csv"
    there.write_text("kept")
    for path, problem in (
        (there, "exists"),
        (tmp_path / "log.xlsx", "type '.xlsx'"),
        (tmp_path / "no" / "log.csv", "no folder"),
        (tmp_path, "type|folder"),
        (None, "no log"),
    ):
        with pytest.raises(InputError, match=problem):
            stream(swing(robot), robot, NOWHERE, log=path)
    assert there.read_text() == "kept"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("state", "problem"),
    [("error", "the error 99"), ("e-stop", "an emergency stop"), ("manual", "manual mode"), ("drives-off", "drives")],
)
def test_controllers_that_are_not_ready(state: str, problem: str, robot, controllers, log: Path) -> None:
    """A controller that reports an error, an emergency stop or manual mode is refused; no point is sent."""
    controller, endpoint = controllers(state=state)
    with pytest.raises(ControllerError, match=problem):
        stream(swing(robot), robot, endpoint, log=log)
    assert controller.points == 0
    assert not log.exists()


@pytest.mark.slow
def test_start_elsewhere(robot, controllers, log: Path) -> None:
    """A robot that stands elsewhere is refused, with joint and both positions."""
    motion = swing(robot)
    controller, endpoint = controllers()
    away = Motion(motion.t, motion.q + np.array([0.0, 0.3]), motion.dq, motion.ddq)
    with pytest.raises(InputError, match=r"joint 2: the robot is at 0, the trajectory begins at 0\.3"):
        stream(away, robot, endpoint, log=log)
    assert controller.points == 0


@pytest.mark.slow
def test_dry_run(robot, controllers, log: Path) -> None:
    """A dry run checks everything, sends no point, and writes nothing."""
    controller, endpoint = controllers()
    result = stream(swing(robot), robot, endpoint, dry_run=True)
    assert (result.dry_run, result.sent, result.rows, controller.points) == (True, 0, 0, 0)
    assert "nothing was sent" in result.summary()


@pytest.mark.parametrize(
    ("transport", "problem"), [("udp", "nothing listens|does not answer"), ("tcp", "nothing listens")]
)
def test_nobody_there(transport, problem: str, robot, log: Path) -> None:
    """A port at which nothing listens is named."""
    with socket.socket(socket.AF_INET, socket.SOCK_STREAM if transport == "tcp" else socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    endpoint = replace(NOWHERE, transport=transport, state_port=port)
    with pytest.raises(LinkError, match=problem):
        stream(swing(robot), robot, endpoint, log=log)


def test_unknown_host(robot, log: Path) -> None:
    """A host without an address is bad input."""
    with pytest.raises(InputError, match="has no address"):
        record(robot, replace(NOWHERE, host="no.such.host.invalid"), log)
    for transport in ("udp", "tcp"):
        # A name that no domain may have is not even looked up.
        with pytest.raises(InputError, match="has no address"):
            record(robot, replace(NOWHERE, host="\u00fc" * 64, transport=transport), log)
    with pytest.raises(InputError, match="the host is empty"):
        replace(NOWHERE, host=" ")


@pytest.mark.slow
@pytest.mark.parametrize("transport", ["udp", "tcp"])
def test_another_protocol(transport, robot, log: Path) -> None:
    """A server of another protocol is recognised as such; the address is wrong input."""
    kind = socket.SOCK_STREAM if transport == "tcp" else socket.SOCK_DGRAM
    server = socket.socket(socket.AF_INET, kind)
    server.bind(("127.0.0.1", 0))
    server.settimeout(3.0)
    if transport == "tcp":
        server.listen()

    def serve() -> None:
        with suppress(OSError):
            if transport == "tcp":
                with server.accept()[0] as connection:
                    connection.sendall(b"SSH-2.0-OpenSSH_9.6\r\n")
                    connection.recv(10)
            else:
                byte, client = server.recvfrom(100)
                server.sendto(byte, client)
                for _ in range(20):
                    server.sendto(b"<xml>not this one</xml>", client)

    thread = threading.Thread(target=serve)
    thread.start()
    endpoint = replace(NOWHERE, transport=transport, state_port=server.getsockname()[1], connect_time=1.0)
    with pytest.raises(ProtocolError, match=r"another protocol|no message") as caught:
        stream(swing(robot), robot, endpoint, log=log, options=SHORT)
    assert caught.value.exit_code == 2
    thread.join()
    server.close()


@pytest.mark.slow
def test_servers_that_wait_or_echo(robot, controllers, log: Path) -> None:
    """A server that waits for a request, as of HTTP, is named at either port, and so is one that sends all back."""

    class Echo(socketserver.BaseRequestHandler):
        def handle(self) -> None:
            while data := self.request.recv(4096):
                self.request.sendall(data)

    motion = swing(robot)
    with (
        ThreadingHTTPServer(("127.0.0.1", 0), SimpleHTTPRequestHandler) as http,
        socketserver.ThreadingTCPServer(("127.0.0.1", 0), Echo) as echo,
    ):
        for server in (http, echo):
            server.daemon_threads = True
            threading.Thread(target=server.serve_forever, daemon=True).start()
        controller, endpoint = controllers(transport="tcp")
        place = replace(endpoint, connect_time=0.4)
        for ports, problem in (
            ({"state_port": http.server_port}, "no feedback .* may be no simple_message controller"),
            ({"motion_port": http.server_port}, "does not answer a ping; check host and motion port"),
            ({"motion_port": http.server_port}, "takes no points.*and the motion port|speaks another protocol"),
            ({"motion_port": echo.server_address[1]}, "sends back what it is sent"),
            ({"motion_port": place.state_port}, "takes no points.*and the motion port"),
        ):
            wrong = replace(place, **ports)
            options = replace(SHORT, ping="a ping" in problem)
            with pytest.raises((ProtocolError, ControllerError), match=problem) as caught:
                stream(motion, robot, wrong, log=log, options=options, force=True)
            assert caught.value.exit_code == (1 if problem.startswith("takes") else 2)
        for server in (http, echo):
            server.shutdown()
    assert controller.points == 0


@pytest.mark.slow
def test_wrong_byte_order_is_named(robot, controllers, log: Path) -> None:
    """A controller with another byte order leads to a message that names it."""
    _, endpoint = controllers(byte_order="big")
    place = replace(endpoint, byte_order="little", connect_time=1.0)
    with pytest.raises(LinkError, match="big byte order"):
        stream(swing(robot), robot, place, log=log, options=SHORT)


@pytest.mark.slow
@pytest.mark.parametrize("transport", ["udp", "tcp"])
def test_two_clients(transport, robot, controllers, tmp_path: Path) -> None:
    """A second client is refused with one message, and the first goes on undisturbed.

    That the robot moves is seen first. Who ignores the controller's state does not get its motion port.
    """
    motion = swing(robot, 500)
    controller, endpoint = controllers(transport=transport, speed=1.0)
    results = []

    def play() -> None:
        results.append(stream(motion, robot, endpoint, log=tmp_path / "first.csv", options=PATIENT))

    first = threading.Thread(target=play)
    first.start()
    while controller.points < 50:
        assert first.is_alive()
    still = replace(endpoint, connect_time=0.3)
    second = tmp_path / "second.csv"
    with pytest.raises(ControllerError, match=r"the robot is moving; .*another client"):
        stream(motion, robot, still, log=second)
    with pytest.raises(LinkError, match="another client"):
        stream(motion, robot, still, log=second, options=StreamOptions(start_tolerance=1.0, ignore_status=True))
    first.join()
    assert not second.exists()
    assert results[0].sent == controller.points == 500
    assert len(read_log(tmp_path / "first.csv", robot.n)) == results[0].rows > 400


def test_taken_port(robot) -> None:
    """A controller does not start at a port that another program uses."""
    options = ControllerOptions(motion_port=0, state_port=0, transport="tcp", feedback="full")
    controller = VirtualController(robot, options=options)
    try:
        with pytest.raises(InputError, match="cannot listen"):
            VirtualController(robot, options=replace(options, motion_port=controller.motion_port))
    finally:
        controller.stop()


@pytest.mark.parametrize(
    "make",
    [
        lambda: Faults(lose=1.5),
        lambda: Faults(silent_after=-1),
        lambda: Faults(late_by=-1.0),
        lambda: ControllerOptions(feedback="video"),  # type: ignore[arg-type]
        lambda: ControllerOptions(capacity=1),
        lambda: ControllerOptions(speed=0),
        lambda: ControllerOptions(motion_port=70000),
        lambda: StreamOptions(window=0),
        lambda: StreamOptions(reply_time=5.0, patience=1.0),
        lambda: StreamOptions(points="some"),  # type: ignore[arg-type]
        lambda: Endpoint(host="h", transport="serial"),  # type: ignore[arg-type]
        lambda: Endpoint(host="h", handshake=300),
        lambda: Endpoint(host="h", motion_port=0),
    ],
)
def test_wrong_settings(make) -> None:
    """A setting out of range is refused."""
    with pytest.raises(InputError):
        make()


def test_wrong_pose(robot) -> None:
    """A pose with another number of joints is refused."""
    with pytest.raises(InputError, match="a pose of 3 values"):
        VirtualController(robot, options=ControllerOptions(motion_port=0, state_port=0), pose=np.zeros(3))

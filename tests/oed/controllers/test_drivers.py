"""Client and test controller speak as each vendor's driver does; emulated readers see the same bytes."""

from __future__ import annotations

import socket
import struct
import threading
from collections.abc import Callable, Iterator
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
    LinkError,
    StreamOptions,
    VirtualController,
    record,
    stream,
)
from oed.controllers.drivers import DRIVERS, Driver, driver_of
from oed.exports.simple_message import WireFormat
from robots.common.errors import InputError
from robots.signals import Motion
from tests.oed.controllers.conftest import swing
from tests.oed.controllers.drivers import FanucReader, Tap, points_seen

NAMES = sorted(name for name, driver in DRIVERS.items() if driver.protocol == "simple_message")
STREAMED = [name for name in NAMES if not DRIVERS[name].download]


@contextmanager
def playing(robot: Any, driver: Driver, **settings: Any) -> Iterator[tuple[VirtualController, Endpoint]]:
    """A controller with a driver, and how a client finds it."""
    names = [name for name in settings if name in Faults.__dataclass_fields__]
    faults = Faults(**{name: settings.pop(name) for name in names})
    options = ControllerOptions.of(driver, **({"motion_port": 0, "state_port": 0, "faults": faults} | settings))
    with VirtualController(robot, options=options) as controller:
        ports = {"motion_port": controller.motion_port, "state_port": controller.state_port}
        yield controller, Endpoint.of(driver, "127.0.0.1", handshake_interval=0.1, connect_time=5.0, **ports)


def motion_for(robot: Any, driver: Driver) -> Motion:
    """A motion of as many points as a driver takes in a short test."""
    return swing(robot, 300) if driver.most is None else swing(robot, driver.most, 0.04)


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_plays_with_each_driver(name: str, robot, log: Path) -> None:
    """A trajectory is played whole twice, from link to link, with the driver's own ports, points and replies."""
    driver = DRIVERS[name]
    motion = motion_for(robot, driver)
    options = StreamOptions.of(driver, patience=10.0)
    with playing(robot, driver) as (controller, place):
        for count in (1, 2):
            result = stream(motion, robot, place, log=log, options=options, force=True)
            assert (result.sent, result.points, result.stopped) == (len(motion), len(motion), True)
            assert controller.points == count * len(motion)
            assert not controller.player.moving
        read = read_log(log, robot.n, torque=False)
        np.testing.assert_allclose(controller.player.pose, motion.q[-1], atol=1e-6)
    assert np.abs(read.q).max() == pytest.approx(np.abs(motion.q).max(), rel=0.1)


@pytest.mark.slow
@pytest.mark.parametrize("name", STREAMED)
def test_stops_with_each_driver(name: str, robot, log: Path) -> None:
    """A robot that leaves its plan is stopped in the way that its driver knows, stands, and takes the next motion."""
    driver = DRIVERS[name]
    motion = swing(robot, 600, 0.6)
    options = StreamOptions.of(driver, patience=10.0)
    with playing(robot, driver, path="offset", path_after=0.5) as (controller, place):
        with pytest.raises(ControllerError, match="joint 1: the robot has left the plan") as caught:
            stream(motion, robot, place, log=log, options=options)
        assert "did not confirm the stop" not in str(caught.value)
        assert not controller.player.moving
        assert controller.points < 600
        with pytest.raises(InputError, match="move the robot to the start"):
            stream(motion, robot, place, log=log, options=options, force=True)


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_dry_runs_with_each_driver(name: str, robot) -> None:
    """A dry run with a driver's profile sends no byte that any reader takes for a point."""
    driver = DRIVERS[name]
    with Tap(driver.transport, ">" if driver.byte_order == "big" else "<") as tap:
        ports = {"motion_port": tap.motion_port, "state_port": tap.state_port, "handshake_interval": 0.1}
        place = Endpoint.of(driver, "127.0.0.1", **ports)
        options = StreamOptions.of(driver)
        stream(motion_for(robot, driver), robot, place, dry_run=True, options=options)
    assert (tap.connections, tap.motion) == (0, b"")
    assert points_seen(tap.state) == []


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_refusals_of_each_driver(name: str, robot, log: Path) -> None:
    """A controller with an emergency stop refuses, and says why."""
    driver = DRIVERS[name]
    with playing(robot, driver, state="e-stop") as (controller, place):
        with pytest.raises(ControllerError, match="emergency stop"):
            stream(motion_for(robot, driver), robot, place, log=log, options=StreamOptions.of(driver))
        if driver.commands:
            options = StreamOptions.of(driver, ignore_status=True)
            with pytest.raises(ControllerError, match="Motoman's driver is not ready: it reports"):
                stream(swing(robot), robot, place, log=log, options=options, force=True)
    assert controller.points == 0


@pytest.mark.parametrize("name", NAMES)
def test_what_a_driver_misreads_is_refused(name: str) -> None:
    """Pings and points of a form that a driver does not know are refused before anything is sent."""
    driver = DRIVERS[name]
    other: Any = "short" if driver.points == "full" else "full"
    if driver.one_form:
        with pytest.raises(InputError, match="misreads points"):
            StreamOptions.of(driver, points=other)
    else:
        assert StreamOptions.of(driver, points=other).points == other
    if driver.pings != "answered":
        with pytest.raises(InputError, match="leave out --ping"):
            StreamOptions.of(driver, ping=True)
    with pytest.raises(InputError, match="not known"):
        driver_of("robox")


def test_more_points_than_a_driver_holds(robot, log: Path) -> None:
    """ABB's driver leaves out what is beyond 100 points: a longer trajectory is refused before anything is opened."""
    place = Endpoint.of(DRIVERS["abb"], "127.0.0.1", motion_port=9, state_port=9)
    with pytest.raises(InputError, match="300 points; allowed: up to 100, as ABB's driver holds"):
        stream(swing(robot), robot, place, log=log, options=StreamOptions.of(DRIVERS["abb"]))


@pytest.mark.slow
def test_one_handshake_only(robot, tmp_path: Path) -> None:
    """A server that answers the first handshake only serves a second recording, for it comes from the same address."""
    with playing(robot, DRIVERS["efort"]) as (_, place):
        for number in range(3):
            result = record(robot, place, tmp_path / f"{number}.csv", duration=0.2)
            assert result.rows > 10
        with pytest.raises(LinkError, match="does not answer the handshake"):
            record(robot, replace(place, one_address=False, connect_time=0.5), tmp_path / "other.csv", duration=0.2)


@pytest.mark.slow
def test_handshakes_push_no_recorder_away(robot, log: Path) -> None:
    """Thousands of handshakes from other ports do not end a recording."""
    options = ControllerOptions(motion_port=0, state_port=0, feedback="full")
    with VirtualController(robot, options=options) as controller:
        place = Endpoint(host="127.0.0.1", motion_port=controller.motion_port, state_port=controller.state_port)

        def knock() -> None:
            for _ in range(3000):
                with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sock:
                    sock.sendto(b"\x8e", ("127.0.0.1", controller.state_port))

        thread = threading.Timer(0.5, knock)
        thread.start()
        result = record(robot, place, log, duration=1.5, patience=0.5)
        thread.join()
    assert result.rows > 200


Serve = Callable[[bytes], bytes]


@contextmanager
def answering(serve: Serve, framed: bool = False) -> Iterator[tuple[int, list[bytes]]]:
    """A motion port of raw sockets: each message of 68 bytes, or of its length, gets the answer of a function."""
    listener = socket.create_server(("127.0.0.1", 0))
    got: list[bytes] = []

    def run() -> None:
        connection, _ = listener.accept()
        with connection:
            while data := connection.recv(4 if framed else 68, socket.MSG_WAITALL):
                if framed:
                    data += connection.recv(struct.unpack("<i", data)[0], socket.MSG_WAITALL)
                got.append(data)
                connection.sendall(serve(data))

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    yield listener.getsockname()[1], got
    thread.join()
    listener.close()


def position_reply(point: bytes) -> bytes:
    """The reply of Fanuc's relay: JOINT_POSITION with the number of the point."""
    (number,) = struct.unpack_from("<i", point, 16)
    return struct.pack("<5i10f", 56, 10, 3, 1, number, *[0.0] * 10)


def zero_reply(point: bytes) -> bytes:
    """A reply that echoes the type, and always has the number zero."""
    return struct.pack("<5i12f", 64, 11, 3, 1, 0, *[0.0] * 12)


def other_reply(point: bytes) -> bytes:
    """A reply of a type that answers no point."""
    return struct.pack("<11i", 40, 13, 3, 1, *[0] * 7)


@pytest.mark.slow
@pytest.mark.parametrize("serve", [position_reply, zero_reply])
def test_replies_of_other_drivers(serve: Serve, robot, log: Path) -> None:
    """Replies of another type, or with the number zero, confirm points; the robot that never moves ends the motion."""
    motion = swing(robot, 100, 0.04)
    with Tap("tcp") as tap, answering(serve) as (port, got):
        place = Endpoint(host="127.0.0.1", transport="tcp", motion_port=port, state_port=tap.state_port)
        options = StreamOptions(points="short", patience=0.5)
        with pytest.raises(ControllerError, match="has not begun to move"):
            stream(motion, robot, place, log=log, options=options)
    assert [struct.unpack_from("<i", data, 16)[0] for data in got] == [*range(100), -4]


@pytest.mark.slow
def test_who_replies_as_motoman_is_stopped_by_command(robot, log: Path) -> None:
    """Motoman's driver refuses a point with the number of a stop: its replies show that a command is needed."""
    stops = []

    def serve(data: bytes) -> bytes:
        kind, number = struct.unpack_from("<i", data, 4)[0], struct.unpack_from("<i", data, 20)[0]
        if kind == 14:
            return struct.pack("<9i10f", 72, 2002, 3, 1, 0, number, 14, 0, 0, *[0.0] * 10)
        stops.append(struct.unpack_from("<4i3i", data))
        return struct.pack("<9i10f", 72, 2002, 3, 1, 0, 0, 200111, 0, 0, *[0.0] * 10)

    with Tap("tcp") as tap, answering(serve, framed=True) as (port, got):
        place = Endpoint(host="127.0.0.1", transport="tcp", motion_port=port, state_port=tap.state_port)
        options = StreamOptions.of(DRIVERS["generic"], points="full", patience=0.5)
        with pytest.raises(ControllerError, match="has not begun to move") as caught:
            stream(swing(robot, 100, 0.04), robot, place, log=log, options=options)
    assert "did not confirm the stop" not in str(caught.value)
    assert len(got) == 101
    assert [(stop[1], stop[6]) for stop in stops] == [(2001, 200111)]


@pytest.mark.slow
def test_a_reply_that_means_nothing_is_named(robot, log: Path) -> None:
    """What came instead of a reply is part of the message."""
    with Tap("tcp") as tap, answering(other_reply) as (port, _):
        place = Endpoint(host="127.0.0.1", transport="tcp", motion_port=port, state_port=tap.state_port)
        options = StreamOptions(points="short", patience=0.4)
        with pytest.raises(ControllerError, match=r"no reply to point 0 .*a message of type 13 came instead"):
            stream(swing(robot), robot, place, log=log, options=options)


@pytest.mark.slow
def test_fanuc_reads_what_is_meant(robot, log: Path) -> None:
    """The bytes of a whole motion are, to the emulated relay, its points in order and a stop, and nothing else."""
    motion = swing(robot, 100, 0.04)
    fanuc = DRIVERS["fanuc"]
    reader = FanucReader(">")

    def serve(data: bytes) -> bytes:
        reader.feed(data)
        (number,) = struct.unpack_from(">i", data, 16)
        return struct.pack(">5i10f", 56, 10, 3, 1, number, *[0.0] * 10)

    with Tap("tcp", ">") as tap, answering(serve) as (port, _):
        place = Endpoint.of(fanuc, "127.0.0.1", motion_port=port, state_port=tap.state_port)
        assert place.form == WireFormat(byte_order="big")
        with pytest.raises(ControllerError, match="has not begun to move"):
            stream(motion, robot, place, log=log, options=StreamOptions.of(fanuc, patience=0.5))
    np.testing.assert_allclose(np.array(reader.points)[:, : robot.n], motion.q, rtol=2e-7, atol=1e-9)
    assert reader.stops == 1


@pytest.mark.slow
@pytest.mark.parametrize("points", ["full", "short"])
def test_external_axes_stay(points: Any, robot, log: Path) -> None:
    """An axis behind those of the robot is refused, or held where it is; a point with a zero would move it."""
    generic = DRIVERS["generic"]
    with playing(robot, generic, external=(0.75, -0.25)) as (controller, place):
        with pytest.raises(InputError, match=r"joint 3: the controller reports a joint 3.*--external-axes"):
            stream(swing(robot), robot, place, log=log, options=StreamOptions.of(generic))
        with pytest.raises(InputError, match="--external-axes"):
            record(robot, place, log, duration=0.1)
        options = StreamOptions.of(generic, points=points, external_axes=True, patience=10.0)
        assert stream(swing(robot), robot, place, log=log, options=options).sent == 300
        assert controller._external[:2] == (0.75, -0.25)
        assert record(robot, place, log, duration=0.2, external_axes=True, force=True).rows > 5
    assert read_log(log, robot.n, torque=False).q.shape[1] == robot.n

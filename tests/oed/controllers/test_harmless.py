"""A dry run, a recording and a refused start send nothing that a vendor's driver takes for a point."""

from __future__ import annotations

import struct
from dataclasses import replace
from pathlib import Path

import pytest

from oed.controllers import ControllerError, Endpoint, StreamOptions, record, stream
from oed.controllers.errors import ProtocolError
from oed.controllers.recording.pose import read_pose
from robots.common.errors import InputError
from robots.signals import Motion
from tests.oed.controllers.conftest import swing
from tests.oed.controllers.drivers import REQUEST, FanucReader, FramedReader, Tap, points_seen

HANDSHAKE = 0x8E
SHORT = StreamOptions(points="short")
ORDERS = {"little": "<", "big": ">"}


def place_of(tap: Tap, transport: str, order: str = "little") -> Endpoint:
    """Where a tap listens."""
    return Endpoint(
        host="127.0.0.1",
        transport=transport,  # type: ignore[arg-type]
        motion_port=tap.motion_port,
        state_port=tap.state_port,
        byte_order=order,  # type: ignore[arg-type]
        connect_time=10.0,
        handshake_interval=0.1,
    )


def test_readers_see_points() -> None:
    """The emulated readers take for points what the drivers do: the short point, and, at Fanuc's, five pings."""
    point = struct.pack("<5i12f", 64, 11, 2, 0, 0, *range(12))
    framed, fanuc = FramedReader("<"), FanucReader("<")
    for reader in (framed, fanuc):
        reader.feed(point[:30])
        reader.feed(point[30:] + point)
        assert reader.points == [tuple(map(float, range(10)))] * 2
    pings = struct.pack("<4i", 12, 1, 2, 0) * 5
    moves = points_seen(pings)
    assert len(moves) == 2
    assert abs(max(map(max, moves))) < 1e-30
    full_stop = struct.pack("<7if30f", 148, 14, 2, 0, 0, -4, 0, 0.0, *[0.0] * 30)
    assert (0.0,) * 10 in points_seen(full_stop)
    short_stop = struct.pack("<5i12f", 64, 11, 2, 0, -4, *[0.0] * 12)
    assert points_seen(short_stop) == []


@pytest.mark.slow
@pytest.mark.parametrize("order", ["little", "big"])
@pytest.mark.parametrize("transport", ["udp", "tcp"])
def test_dry_runs_only_listen(transport: str, order: str, robot) -> None:
    """The motion port is not even opened, and the state port gets no byte but the one that opens a link by UDP."""
    with Tap(transport, ORDERS[order]) as tap:
        place = place_of(tap, transport, order)
        result = stream(swing(robot), robot, place, dry_run=True, options=SHORT)
        read_pose(robot, place)
    assert "nothing was sent" in result.summary()
    assert (tap.connections, tap.motion) == (0, b"")
    assert set(tap.state) <= {HANDSHAKE}
    assert points_seen(tap.state) == []


@pytest.mark.slow
@pytest.mark.parametrize("transport", ["udp", "tcp"])
def test_dry_runs_answer_no_requests(transport: str, robot) -> None:
    """The echo of a requested position is a joint point to a driver; a dry run leaves it out."""
    with Tap(transport, comm=REQUEST) as tap:
        stream(swing(robot), robot, place_of(tap, transport), dry_run=True, options=SHORT)
    assert set(tap.state) <= {HANDSHAKE}


@pytest.mark.slow
def test_pings_are_sent_on_demand_only(robot) -> None:
    """Who asks a dry run for pings gets them: they are what an explicit ``ping`` means."""
    options = StreamOptions(points="short", ping=True, patience=0.3)
    with Tap("tcp") as tap:
        place = replace(place_of(tap, "tcp"), connect_time=0.5)
        with pytest.raises(ProtocolError, match="does not answer a ping"):
            stream(swing(robot), robot, place, dry_run=True, options=options)
    assert tap.motion == struct.pack("<4i", 12, 1, 2, 0) * (len(tap.motion) // 16) != b""


@pytest.mark.slow
@pytest.mark.parametrize("transport", ["udp", "tcp"])
def test_refused_starts_send_nothing(transport: str, robot, log: Path) -> None:
    """An emergency stop ends the command before any byte but the handshake reaches the motion port, stops included."""
    motion = swing(robot)
    with Tap(transport, e_stopped=True) as tap, pytest.raises(ControllerError, match="emergency stop"):
        stream(motion, robot, place_of(tap, transport), log=log, options=SHORT)
    assert set(tap.motion) <= {HANDSHAKE}
    with Tap(transport) as tap:
        away = Motion(motion.t, motion.q + 0.2, motion.dq, motion.ddq)
        with pytest.raises(InputError, match="the trajectory begins at"):
            stream(away, robot, place_of(tap, transport), log=log)
    assert (tap.connections, tap.motion) == (0, b"")


@pytest.mark.slow
@pytest.mark.parametrize("transport", ["udp", "tcp"])
def test_recordings_send_nothing(transport: str, robot, log: Path) -> None:
    """A recording opens no motion port."""
    with Tap(transport) as tap:
        record(robot, place_of(tap, transport), log, duration=0.3)
    assert (tap.connections, tap.motion) == (0, b"")
    assert set(tap.state) <= {HANDSHAKE}


@pytest.mark.slow
def test_full_points_need_a_known_driver(robot, log: Path) -> None:
    """By TCP a controller that reports positions only may be Fanuc's, to which a full point is two: it gets none."""
    with Tap("tcp") as tap, pytest.raises(InputError, match=r"state its driver .*or send short points"):
        stream(swing(robot), robot, place_of(tap, "tcp"), log=log)
    assert tap.motion == b""
    assert not log.exists()

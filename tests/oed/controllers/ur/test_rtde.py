"""RTDE against a controller of raw sockets: what is asked, what is recorded, and what is refused."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from estimation import read_log
from oed.controllers import ControllerError, Endpoint, StreamOptions, driver_of, record, stream
from oed.controllers.errors import LinkError, ProtocolError
from oed.controllers.rtde.packages import Command, Packages, package
from oed.exports.simple_message import MessageError
from robots.common.errors import InputError
from robots.loading import load_robot
from robots.robot import Robot
from tests.oed.controllers.conftest import swing
from tests.oed.controllers.ur.tap import SILENT, RtdeTap

UR = driver_of("ur")
AS_TORQUE = "actual_current_as_torque"
HARMLESS = {"V", "v", "O", "S"}
"""Version, version of the controller, setup of outputs, start: none of them is an input."""


@pytest.fixture(scope="module")
def ur10() -> Robot:
    """Load a UR10."""
    return load_robot("ur10")


def place_of(tap: RtdeTap) -> Endpoint:
    """Where a tap listens."""
    return Endpoint.of(UR, "127.0.0.1", motion_port=tap.motion_port, state_port=tap.state_port, connect_time=1.0)


def test_packages_as_the_guide_writes_them() -> None:
    """The request for version 2 has five bytes; packages are cut wherever the stream is."""
    asked = package(Command.VERSION, b"\0\2")
    assert asked == bytes.fromhex("00 05 56 00 02")
    cut = Packages()
    assert [cut.feed(bytes([byte])) for byte in asked] == [[], [], [], [], [asked]]
    assert Packages().feed(asked * 3 + asked[:2]) == [asked] * 3
    for size in (b"\0\2V", b"\xff\xffV"):
        with pytest.raises(MessageError, match="a package of"):
            Packages().feed(size)


@pytest.mark.slow
@pytest.mark.parametrize(("version", "frequency"), [((3, 15), 125.0), ((5, 12), 500.0), ((10, 6), 500.0)])
def test_recordings(version: tuple[int, int], frequency: float, ur10: Robot, log: Path) -> None:
    """A log has the controller's time, positions, velocities, currents, temperatures and moments at its full rate."""
    pose = (0.1 * np.arange(1, 7)).tolist()
    with RtdeTap(pose, missing=(AS_TORQUE,), version=version) as tap:
        record(ur10, place_of(tap), log, duration=0.4)
    assert set(tap.commands) == HARMLESS
    assert (tap.connections, set(tap.frequencies)) == (0, {frequency})
    read = read_log(log, 6)
    assert len(read) > 20
    np.testing.assert_allclose(read.q, np.tile(pose, (len(read), 1)))
    np.testing.assert_allclose(read.dq[0], 10 + np.arange(6))
    np.testing.assert_allclose(read.current[0], 20 + np.arange(6))
    np.testing.assert_allclose(read.temperature[0], 40 + np.arange(6))
    assert "target_moment6" in log.read_text().splitlines()[-len(read) - 1]
    assert (np.diff(read.t) > 0).all()


@pytest.mark.slow
def test_dry_runs_only_subscribe(ur10: Robot) -> None:
    """A dry run opens no port for programs, and sends no input."""
    motion = swing(ur10, 500)
    with RtdeTap(motion.q[0].tolist(), missing=(AS_TORQUE,)) as tap:
        result = stream(motion, ur10, place_of(tap), dry_run=True, options=StreamOptions.of(UR))
    assert "nothing was sent" in result.summary()
    assert (set(tap.commands), tap.connections, tap.programs) == (HARMLESS, 0, b"")


@pytest.mark.slow
def test_refused_starts_send_no_program(ur10: Robot, log: Path) -> None:
    """A stop, another start pose and another number of joints end the command before a program is sent."""
    motion = swing(ur10, 500)
    options = StreamOptions.of(UR)
    for mode, words in ((3, r"safety mode 3 \(protective stop\)"), (7, "an emergency stop"), (9, r"\(fault\)")):
        with RtdeTap(motion.q[0].tolist(), missing=(AS_TORQUE,), safety_mode=mode) as tap:
            with pytest.raises(ControllerError, match=words):
                stream(motion, ur10, place_of(tap), log=log, options=options)
            assert tap.programs == b""
    with RtdeTap((motion.q[0] + 0.3).tolist(), missing=(AS_TORQUE,)) as tap:
        with pytest.raises(InputError, match="the trajectory begins at"):
            stream(motion, ur10, place_of(tap), log=log, options=options)
        assert (tap.programs, tap.connections) == (b"", 0)
    with RtdeTap([0.0] * 6) as tap:
        panda = load_robot("panda")
        with pytest.raises(InputError, match="a UR controller takes"):
            stream(swing(panda, 500, 0.05), panda, place_of(tap), log=log, options=options)
    tap = RtdeTap([0.0] * 6, missing=(AS_TORQUE,))
    with tap, pytest.raises(InputError, match="reports 6 joints, panda has 7"):
        record(panda, place_of(tap), log)
    assert not log.exists()


@pytest.mark.slow
def test_old_and_foreign_servers(ur10: Robot, log: Path) -> None:
    """A controller without the register of clients, a silent one, and a closed port end in one message each."""
    with (
        RtdeTap([0.0] * 6, missing=("output_int_register_24", AS_TORQUE)) as tap,
        pytest.raises(ProtocolError, match=r"no output_int_register_24.*update the controller"),
    ):
        record(ur10, place_of(tap), log)
    with RtdeTap([0.0] * 6, manner=SILENT) as tap, pytest.raises(ProtocolError, match="does not answer as an RTDE"):
        record(ur10, place_of(tap), log)
    place = place_of(tap)
    with pytest.raises(LinkError, match="nothing listens"):
        record(ur10, place, log)
    with pytest.raises(InputError, match="leave out --byte-order"):
        replace(place, byte_order="little")
    with pytest.raises(InputError, match="knows no pings"):
        StreamOptions.of(UR, ping=True)
    assert not log.exists()

"""ABB's guided motion: bytes of its messages, and trajectories on the controller to test against."""

from __future__ import annotations

import socket
import struct
import threading
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
from oed.controllers.egm.messages import EgmForm, guide_message, guided_axes, robot_message
from oed.controllers.errors import LinkError, ProtocolError
from oed.controllers.virtual.egm import VirtualEgm
from oed.exports import ExportOptions, export_trajectory
from oed.exports.simple_message import MessageError
from robots.common.errors import InputError
from robots.joints.controller_axes import ControllerAxes
from robots.loading import load_robot
from robots.robot import Robot
from tests.oed.controllers.conftest import swing
from tests.oed.exports.languages import Rapid

EGM = driver_of("egm")
PATIENT = StreamOptions.of(EGM, patience=20.0)


@pytest.fixture(scope="module")
def er3a() -> Robot:
    """Load an arm whose controller turns one axis round and couples another."""
    axes = ControllerAxes(
        sign=np.array([1.0, -1, 1, 1, 1, 1]),
        zero=np.deg2rad([0.0, 0, 90, 0, 0, 0]),
        coupling=np.where(np.arange(36).reshape(6, 6) == 13, -1.0, 0.0),
    )
    return replace(load_robot("er3a"), axes=axes)


@contextmanager
def guided(robot: Robot, pose: Any = None, **settings: Any) -> Iterator[tuple[VirtualEgm, Endpoint]]:
    """Start a controller that sends to a free port."""
    faults = Faults(**{name: settings.pop(name) for name in list(settings) if name in Faults.__dataclass_fields__})
    options = ControllerOptions.of(EGM, state_port=0, faults=faults, **settings)
    controller = virtual_controller(robot, options=options, pose=pose)
    assert isinstance(controller, VirtualEgm)
    ports = {"motion_port": controller.state_port, "state_port": controller.state_port}
    with controller:
        yield controller, Endpoint.of(EGM, "127.0.0.1", connect_time=10.0, **ports)


def test_bytes() -> None:
    """Messages are Protocol Buffers as egm.proto numbers them: written by hand here."""
    joints = b"".join(b"\x09" + struct.pack("<d", value) for value in (1.5, -2.0))
    block = b"\x0a" + bytes([len(joints)]) + joints
    correction = b"\x0a\x04\x08\x07\x18\x03" + b"\x12" + bytes([len(block)]) + block
    assert guide_message(7, [1.5, -2.0]) == correction
    assert guided_axes(correction) == [1.5, -2.0]
    # Number 300, 2000 ms, data; joints; clock of 2 s and 5 us; further fields of other kinds are left out.
    header = b"\x0a\x08\x08\xac\x02\x10\xd0\x0f\x18\x02"
    feedback = block + b"\x22\x04\x08\x02\x10\x05"
    rest = b"\x22\x02\x08\x01" + b"\x2a\x02\x08\x03" + b"\x30\x01" + b"\x51" + struct.pack("<d", 0.5)
    data = header + b"\x12" + bytes([len(feedback)]) + feedback + rest
    assert data.startswith(robot_message(300, 2.000005, [1.5, -2.0]))
    message: Any = EgmForm().decode(data).message
    np.testing.assert_allclose(message.positions, np.deg2rad([1.5, -2.0]))
    assert message.time == pytest.approx(2.000005)
    assert (message.status.drives_powered, message.status.motion_possible) == (1, 1)
    assert EgmForm().decode(robot_message(1, 0.0, [0.0], 2)).message.status.drives_powered == 0  # type: ignore[union-attr]
    for wrong in (b"", data[:-3] + b"\xff", b"\xff" * 12, correction, data[:20]):
        with pytest.raises(MessageError):
            EgmForm().decode(wrong)


@pytest.mark.slow
def test_played(er3a: Robot, log: Path) -> None:
    """The robot is brought to the start, plays in the controller's time, and follows after its lag."""
    motion = swing(er3a, 500)
    with guided(er3a, motion.q[0] + 0.004) as (controller, place):
        result = stream(motion, er3a, place, log=log, options=PATIENT)
        assert (result.sent, result.stopped) == (500, True)
        assert controller.malformed == 0
    read = read_log(log, 6, torque=False)
    assert read.metadata["ended"] == "done"
    np.testing.assert_allclose(read.metadata["command_lag"], controller.lag, atol=0.006)
    np.testing.assert_allclose(read.q.max(axis=0), motion.q.max(axis=0), atol=1e-3)
    np.testing.assert_allclose(read.q[-1], motion.q[-1], atol=1e-6)
    assert np.abs(np.diff(read.q, axis=0)).max() < 0.01


@pytest.mark.slow
def test_who_only_listens_sends_nothing(er3a: Robot, log: Path) -> None:
    """A dry run, a recording and a refused start answer no message."""
    motion = swing(er3a, 500)
    with guided(er3a, motion.q[0]) as (controller, place):
        assert "nothing was sent" in stream(motion, er3a, place, dry_run=True, options=PATIENT).summary()
        record(er3a, place, log, duration=0.3)
    with guided(er3a, motion.q[0] + 0.1) as (away, place), pytest.raises(InputError, match="the trajectory begins at"):
        stream(motion, er3a, place, log=log, options=PATIENT, force=True)
    assert (controller.points, controller.malformed, away.points, away.malformed) == (0, 0, 0, 0)
    q = read_log(log, 6, torque=False).q
    np.testing.assert_allclose(q, np.tile(motion.q[0], (len(q), 1)))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"e_stop_after": 400}, "reports drives without power after point"),
        ({"error_after": 400}, "that motion is not possible after point"),
        ({"silent_after": 400}, "is silent for"),
        ({"path": "sign", "path_after": 1.5}, "the robot has left the plan"),
        ({"stuck": True}, "that motion is not possible"),
        ({"state": "drives-off"}, "drives without power"),
    ],
)
def test_what_ends_a_motion(settings: dict[str, Any], words: str, er3a: Robot, log: Path) -> None:
    """Each fault ends the command with one message, and the command of the robot has come to rest."""
    motion = swing(er3a, 750)
    with guided(er3a, motion.q[0], **settings) as (controller, place):
        with pytest.raises((ControllerError, LinkError), match=words):
            stream(motion, er3a, place, log=log, options=replace(PATIENT, patience=1.0))
        if "silent_after" not in settings:
            assert np.abs(controller._arm.speed).max() < 1e-6
    if log.exists():
        assert read_log(log, 6, torque=False).metadata["complete"] is False


@pytest.mark.slow
def test_ports_and_strangers(er3a: Robot, log: Path) -> None:
    """A taken port, no controller, another computer's messages and messages of another kind are one error each."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("", 0))
        place = Endpoint.of(EGM, "127.0.0.1", state_port=taken.getsockname()[1], connect_time=0.3)
        with pytest.raises(InputError, match="end the program that uses it"):
            record(er3a, place, log)
    with pytest.raises(ProtocolError, match="no feedback"):
        record(er3a, place, log)
    with guided(er3a) as (_, there), pytest.raises(ProtocolError, match="no feedback"):
        record(er3a, replace(there, host="127.0.0.2", connect_time=0.5), log)
    end = threading.Event()
    sender = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)

    def babble() -> None:
        while not end.wait(0.01):
            sender.sendto(b"hello, robot", ("127.0.0.1", place.state_port))

    thread = threading.Thread(target=babble)
    thread.start()
    with pytest.raises(ProtocolError, match="what comes is no message"):
        record(er3a, place, log)
    end.set()
    thread.join()
    sender.close()
    assert not log.exists()


def test_module(er3a: Robot, tmp_path: Path) -> None:
    """The module checks the start, moves there slowly, and lets itself be guided."""
    motion = swing(er3a, 500)
    options = ExportOptions(name="excite")
    export_trajectory(tmp_path / "excite.mod", motion, er3a, "abb-egm", options=options)
    module = Rapid((tmp_path / "excite.mod").read_text())
    assert module.procedures == ["EXCITE_PLAY"]
    kinds = module.order
    order = ["STOP", "MOVEABSJ", "EGMRESET", "EGMGETID", "EGMSETUPUC", "EGMACTJOINT", "EGMRUNJOINT"]
    places = [kinds.index(name) for name in order]
    assert places == sorted(places)
    assert er3a.axes is not None
    np.testing.assert_allclose(module.targets["POINTS"][0], np.rad2deg(er3a.axes.axes(motion.q[0])), atol=1e-6)

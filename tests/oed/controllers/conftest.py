"""A small robot, a trajectory within its limits, and controllers on free ports of this computer."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from oed.controllers import ControllerOptions, Endpoint, Faults, StreamOptions, VirtualController
from oed.controllers.clients import ending
from oed.controllers.recording import recorder
from robots.loading import load_robot
from robots.robot import Robot
from robots.signals import Motion
from tests.oed.cli.conftest import ROBOT

PERIOD = 0.004
PATIENT = StreamOptions(patience=20.0)
"""For motions that should end well: a busy computer may keep a reply back, and nothing waits for the end of this."""


@pytest.fixture(autouse=True)
def _impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    """Waits are for people's controllers; those of the tests run faster than real time."""
    monkeypatch.setattr(recorder, "FEEDBACK_TRIAL_TIME", 0.1)
    monkeypatch.setattr(ending, "STANDING_TIME", 0.1)
    monkeypatch.setattr(ending, "STANDING_TIME_WITHOUT_STATUS", 0.3)


@pytest.fixture(scope="session")
def robot(tmp_path_factory: pytest.TempPathFactory) -> Robot:
    """Describe a robot of two joints."""
    path = tmp_path_factory.mktemp("robot") / "two.yaml"
    path.write_text(ROBOT.replace("VELOCITY", "2"))
    return load_robot(path)


def swing(robot: Robot, points: int = 300, size: float = 0.4) -> Motion:
    """A trajectory from home and back, at rest at both ends: sin^2 to a third of the time."""
    t = PERIOD * np.arange(points)
    w = np.pi / t[-1]
    share = np.linspace(1.0, 0.6, robot.n) * size
    q = robot.limits.home + np.outer(np.sin(w * t) ** 2, share)
    dq = np.outer(w * np.sin(2 * w * t), share)
    ddq = np.outer(2 * w**2 * np.cos(2 * w * t), share)
    return Motion(t, q, dq, ddq)


@pytest.fixture
def controllers(robot: Robot) -> Iterator[Callable[..., tuple[VirtualController, Endpoint]]]:
    """Start controllers; they end with the test."""
    started = []

    def start(*, plant: Any = None, pose: Any = None, **settings: Any) -> tuple[VirtualController, Endpoint]:
        faults = Faults(**{name: settings.pop(name) for name in list(settings) if name in Faults.__dataclass_fields__})
        defaults: dict[str, Any] = {"speed": 5.0, "wait_for_points": True, "motion_port": 0, "state_port": 0}
        options = ControllerOptions(faults=faults, **(defaults | settings))
        controller = VirtualController(robot, plant, options=options, pose=pose)
        controller.start()
        started.append(controller)
        endpoint = Endpoint(
            host=options.host,
            transport=options.transport,
            motion_port=controller.motion_port,
            state_port=controller.state_port,
            byte_order=options.form.byte_order,
            real_bytes=options.form.real_bytes,
            handshake=options.handshake,
            # A busy computer may take its time to answer; no test waits for its end.
            connect_time=20.0,
            handshake_interval=0.1,
        )
        return controller, endpoint

    yield start
    for controller in started:
        controller.stop()


@pytest.fixture
def log(tmp_path: Path) -> Path:
    """Name a log."""
    return tmp_path / "log.csv"

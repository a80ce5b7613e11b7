"""A short campaign of a small robot, and the controller that plays it."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

import oed
from oed.campaigns import Programme
from oed.controllers import ControllerOptions, Endpoint, StreamOptions, VirtualController
from oed.exports import read_trajectory
from robots.loading import load_robot
from robots.robot import Robot
from tests.oed.cli.conftest import ROBOT

SPEED = 10.0
FAST = StreamOptions(download=True, patience=10.0)
NOWHERE = Endpoint(host="127.0.0.1", motion_port=9, state_port=9, connect_time=0.2, handshake_interval=0.1)


@pytest.fixture(scope="session")
def planned(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A robot file, and the campaign of a cold robot: it holds still, then three friction stages with rests between."""
    folder = tmp_path_factory.mktemp("planned")
    (folder / "two.yaml").write_text(ROBOT.replace("VELOCITY", "2"))
    programme = Programme(cycles=0, cooling=3, cycle_time=12.0, power_on=1.0, levels=(0.5, 1.0), plateau=0.2)
    oed.campaign(load_robot(folder / "two.yaml"), programme=programme, collision=False).save(folder)
    return folder


@pytest.fixture
def campaign(planned: Path, tmp_path: Path) -> Path:
    """A copy of the campaign's folder."""
    return Path(shutil.copytree(planned, tmp_path / "campaign"))


@pytest.fixture
def two(planned: Path) -> Robot:
    """Load the robot."""
    return load_robot(planned / "two.yaml")


@pytest.fixture
def endpoint(two: Robot, campaign: Path) -> Iterator[Endpoint]:
    """Start a controller whose robot stands at the campaign's home."""
    home = read_trajectory(campaign / "friction.csv")[0].q[0]
    options = ControllerOptions(transport="tcp", motion_port=0, state_port=0, speed=SPEED, wait_for_points=True)
    with VirtualController(two, options=options, pose=home) as controller:
        yield Endpoint(
            host="127.0.0.1",
            transport="tcp",
            motion_port=controller.motion_port,
            state_port=controller.state_port,
        )

"""A small robot, a short design of it, and the waits of a controller that plays faster than real time."""

from __future__ import annotations

from pathlib import Path

import pytest

from oed.experiments import Effort
from robots.loading import load_robot
from robots.robot import Robot
from tests.oed import flat
from tests.oed.cli.conftest import ROBOT

TINY = Effort(islands=1, starts=1, screened=10, hops=0, finish_samples=100)


@pytest.fixture(scope="session")
def robot_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Describe a robot of two joints."""
    path = tmp_path_factory.mktemp("robot") / "two.yaml"
    path.write_text(ROBOT.replace("VELOCITY", "2"))
    return path


@pytest.fixture(scope="session")
def two(robot_file: Path) -> Robot:
    """Load it."""
    return load_robot(robot_file)


@pytest.fixture(scope="session")
def designed(two: Robot, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A design of one period, 8 s long."""
    folder = tmp_path_factory.mktemp("design")
    flat.design(two, effort=TINY, workers=1, periods=1, base_frequency=0.25).save(folder)
    return folder

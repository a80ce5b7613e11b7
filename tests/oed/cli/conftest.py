"""The command as its user calls it: arguments in, exit code and two streams out."""

from __future__ import annotations

import json
import sys
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

import robots.loading
from oed.cli import main
from oed.experiments import EFFORTS, Effort
from tests.oed import flat

TINY = Effort(islands=1, starts=1, screened=10, hops=0, finish_samples=100)


@dataclass(frozen=True)
class Done:
    """How a command ended."""

    code: int
    out: str
    err: str

    @property
    def data(self) -> Any:
        """Standard output as JSON, nothing else being there."""
        return json.loads(self.out, parse_constant=_reject)


def _reject(name: str) -> None:
    raise AssertionError(f"{name} is no JSON")


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Callable[..., Done]:
    """Run ``oed`` with arguments; ``--effort quick`` is quicker here than in earnest."""
    monkeypatch.setitem(EFFORTS, "quick", TINY)
    monkeypatch.setattr(robots.loading, "_warned", set())

    def call(*arguments: object) -> Done:
        monkeypatch.setattr(sys, "argv", ["oed", *map(str, arguments)])
        capsys.readouterr()
        code = 0
        with warnings.catch_warnings():
            try:
                main()
            except SystemExit as stop:
                code = int(stop.code or 0)
        captured = capsys.readouterr()
        return Done(code, captured.out, captured.err)

    return call


ROBOT = """\
name: two
geometry:
  convention: modified
  joints:
    - {name: lift, d: 0.3}
    - {name: swing, alpha: 1.5707963267948966, a: 0.1}
limits:
  position: {lower: [-2, -2], upper: [2, 2], unit: rad}
  velocity: {values: [2, VELOCITY], unit: rad/s}
  acceleration: {values: [10, 10], unit: rad/s2, source: assumed}
  jerk: {values: [200, 200], unit: rad/s3, source: assumed}
  torque: {values: [200, 200], unit: N m}
dynamics:
  links:
    - {mass: 5, com: [0.02, 0, 0.1], inertia_at_com: [0.05, 0, 0, 0.05, 0, 0.03]}
    - {mass: 3, com: [0.2, 0.01, 0], inertia_at_com: [0.01, 0, 0, 0.04, 0, 0.04]}
  friction:
    coulomb: {values: [4, 3]}
    viscous: {values: [3, 2]}
"""


@pytest.fixture(scope="session")
def robot(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Describe a small robot of two joints."""
    path = tmp_path_factory.mktemp("robot") / "two.yaml"
    path.write_text(ROBOT.replace("VELOCITY", "2"))
    return path


@pytest.fixture(scope="session")
def stuck(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Describe the same robot with a second joint that cannot move."""
    path = tmp_path_factory.mktemp("robot") / "stuck.yaml"
    path.write_text(ROBOT.replace("VELOCITY", "0"))
    return path


@pytest.fixture(scope="session")
def experiment(robot: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Design an experiment, simulate it and identify the robot by the library: a folder with what commands read."""
    from estimation import identify
    from estimation.logs import write_log
    from oed.exports import read_trajectory
    from robots.loading import load_robot
    from robots.plants import nominal_plant, simulate

    folder = tmp_path_factory.mktemp("experiment")
    described = load_robot(robot)
    flat.design(described, effort=TINY, workers=1, periods=1).save(folder)
    log = simulate(nominal_plant(described), read_trajectory(folder / "trajectory.csv")[0])
    write_log(folder / "log.csv", log)
    identify(described, [log]).save(folder)
    return folder

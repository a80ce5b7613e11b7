"""Logs in which the robot rests for most of the time."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from estimation import identify
from oed.experiments import Effort
from robots.loading import load_robot
from robots.plants import nominal_plant, simulate
from robots.signals import Log
from tests.oed import flat
from tests.oed.cli.conftest import ROBOT

TINY = Effort(islands=1, starts=1, screened=10, hops=0, finish_samples=100)


@pytest.mark.slow
def test_rest_before_the_motion(tmp_path: Path) -> None:
    """A robot that holds still for most of a log, with a constant torque, is identified as from the motion alone."""
    (tmp_path / "two.yaml").write_text(ROBOT.replace("VELOCITY", "2"))
    robot = load_robot(tmp_path / "two.yaml")
    plant, planned = nominal_plant(robot), flat.design(robot, effort=TINY, workers=1, periods=1).motion
    moving = simulate(plant, planned, seed=1)
    assert moving.tau is not None
    rows, still = 3 * len(moving), np.zeros((1, 2))
    held = plant.model.torque(planned.q[:1], still, still, plant.parameters)
    log = Log(
        t=0.004 * np.arange(rows + len(moving)),
        q=np.concatenate([np.repeat(moving.q[:1], rows, axis=0), moving.q]),
        tau=np.concatenate([np.repeat(held, rows, axis=0), moving.tau]),
    )
    alone, whole = (identify(robot, [part]).model for part in (moving, log))
    # Both see the same motion: they predict its torque alike, to the noise of 2 %.
    motion = (planned.q, planned.dq, planned.ddq)
    difference = np.sqrt(np.mean((whole.torque(*motion) - alone.torque(*motion)) ** 2, axis=0))
    assert (difference < 0.02 * np.sqrt(np.mean(moving.tau**2, axis=0))).all()

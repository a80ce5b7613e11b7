"""Logs of a virtual ur10 with and without a payload, of a plant that shares no code with what is tested."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from estimation import Estimate, identify
from oed.benchmarks.truth.description import write_description
from oed.benchmarks.truth.dynamics import with_tool
from oed.benchmarks.truth.machines import draw_machine
from oed.benchmarks.truth.noise import draw_noise
from oed.benchmarks.truth.plant import play
from oed.benchmarks.truth.references import draw_periodic
from robots import load_robot
from robots.robot import Robot
from robots.signals import Log

MASS, CENTRE, INERTIA = 2.0, np.array([0.03, -0.02, 0.11]), np.diag([0.006, 0.007, 0.004])


@dataclass(frozen=True, kw_only=True)
class Experiment:
    """A robot, its logs of 20 s, and the model of the first.

    ``free`` and ``loaded`` follow one path, ``other`` follows another with the payload.
    """

    robot: Robot
    free: Log
    loaded: Log
    other: Log
    estimate: Estimate


@pytest.fixture(scope="session")
def experiment(tmp_path_factory: pytest.TempPathFactory) -> Experiment:
    """A ur10 with links 8 % off its description, under position control, with 2.5 % of coloured noise."""
    rng = np.random.default_rng(54)
    machine = draw_machine("ur10", rng)
    noise = draw_noise(machine.n, machine.gear, rng)
    path, other = (draw_periodic(machine, rng, cycles=2) for _ in range(2))
    robot = load_robot(write_description(machine, Path(tmp_path_factory.mktemp("described"))))
    carrying = replace(machine, model=with_tool(machine.model, pin.Inertia(MASS, CENTRE, INERTIA)))
    free, loaded, new = (
        Log(t=record.t, q=record.q, tau=record.tau)
        for record in (
            play(arm, [motion], [], noise, rng)[0]
            for arm, motion in ((machine, path), (carrying, path), (carrying, other))
        )
    )
    # The recorder of the second log was started 3 s earlier on its own clock.
    loaded = replace(loaded, t=loaded.t + 100.0)
    return Experiment(robot=robot, free=free, loaded=loaded, other=new, estimate=identify(robot, free))

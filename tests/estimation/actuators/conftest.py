"""A leg played by MuJoCo, once for all tests of drives."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from benchmarks.actuators_parts.plants import MACHINES, Machine, Truth, mjcf, multisine, play, random_truth
from estimation.actuators import ActuatorOptions, Actuators, identify_actuators
from robots.drives import Drive, described_drives
from robots.drives.branches import load_branches
from robots.robot import Robot
from robots.signals import Log

LEG = MACHINES["leg"]()


class Played(NamedTuple):
    """A plant, its file, its chains, what was described, and two logs of other motions."""

    machine: Machine
    path: Path
    chains: tuple[Robot, ...]
    drives: tuple[Drive, ...]
    truth: Truth
    log: Log
    held_out: Log


def played(folder: Path, truth: Truth, seconds: float = 3.0) -> Played:
    """Plays two motions on a plant."""
    path = folder / "leg.xml"
    path.write_text(mjcf(LEG))
    chains = load_branches(path)
    logs = []
    for seed in (11, 12):
        t, command = multisine(LEG, seconds, np.random.default_rng(seed), 0.002)
        logs.append(Log(t=t, q=play(LEG, truth, t, command), command=command, name=f"run{seed}"))
    return Played(LEG, path, chains, described_drives(chains).drives, truth, *logs)


@pytest.fixture(scope="session")
def leg(tmp_path_factory: pytest.TempPathFactory) -> Played:
    """A leg without hidden effects."""
    return played(tmp_path_factory.mktemp("leg"), random_truth(LEG, np.random.default_rng(5)))


@pytest.fixture(scope="session")
def identified(leg: Played) -> Actuators:
    """Its drives."""
    return identify_actuators(
        leg.chains, leg.log, leg.drives, held_out=leg.held_out, options=ActuatorOptions(effects=False)
    )

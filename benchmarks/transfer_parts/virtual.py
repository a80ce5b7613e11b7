"""Virtual robots of the truth plant: a motion slowed 2.5 times is fitted, the full one predicted."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.transfer_parts.splits import Split
from oed.benchmarks.truth.description import write_description
from oed.benchmarks.truth.machines import Machine, draw_machine
from oed.benchmarks.truth.noise import Noise, draw_noise
from oed.benchmarks.truth.plant import play
from oed.benchmarks.truth.references import Reference, draw_periodic
from robots import load_robot
from robots.signals import Log

KINDS = ("er3a", "ur10", "panda")
SLOWER = 2.5


@dataclass(frozen=True)
class _Slowed:
    """A motion, so many times slower."""

    curve: Any

    def at(self, t: NDArray[np.float64]) -> tuple[NDArray[np.float64], ...]:
        """Evaluates position, velocity and acceleration (N, n)."""
        q, v, a = self.curve.at(t / SLOWER)
        return q, v / SLOWER, a / SLOWER**2


def slowed(kind: str, seed: int) -> Iterator[Split]:
    """Draws a robot and a motion: the slow log predicts the full motion, and so does a log of the full motion."""
    rng = np.random.default_rng([seed, 53])
    machine = draw_machine(kind, rng)
    full = draw_periodic(machine, rng, cycles=2)
    slow = replace(full, duration=full.duration * SLOWER, period=None, curve=_Slowed(full.curve))
    noise = draw_noise(machine.n, machine.gear, rng)
    logs = [_log(machine, reference, noise, rng) for reference in (slow, full, full)]
    with tempfile.TemporaryDirectory() as folder:
        robot = load_robot(write_description(machine, Path(folder)))
        every = np.ones(len(logs[2]), dtype=bool)
        yield Split(f"{kind}, slow to full", robot, (logs[0],), logs[2], every)
        yield Split(f"{kind}, full to full", robot, (logs[1],), logs[2], every)


def _log(machine: Machine, reference: Reference, noise: Noise, rng: np.random.Generator) -> Log:
    (record,) = play(machine, [reference], [], noise, rng)
    return Log(t=record.t, q=record.q, tau=record.tau)

"""Interface of true effects: move links relative to motors, add torque, or falsify a logged signal."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from oed.benchmarks.truth.machines import Machine
from oed.benchmarks.truth.ride import Ride

Kind = TypeVar("Kind", bound="Effect")


@dataclass(frozen=True, kw_only=True)
class Effect:
    """An effect with the size ``amount`` on a joint (from 1), or on the whole robot (None)."""

    joint: int | None = None
    amount: float = 1.0

    name = ""
    smallest = 0.0
    largest = np.inf
    # Exponent with which the visible size grows with the amount; the start of the search for the amount.
    power = 1.0
    lasting = True
    # Whether its torque loads the gears, like a payload or an external force.
    loads_gears = False

    @classmethod
    def draw(cls: type[Kind], machine: Machine, rng: np.random.Generator, joint: int | None, span: float) -> Kind:
        """Draws the effect's shape; ``span`` [s] is the duration of the logs to diagnose."""
        return cls(joint=joint)

    @classmethod
    def joints(cls, machine: Machine) -> tuple[int | None, ...]:
        """Lists the joints on which it can act, from 1; (None,) for the whole robot."""
        return tuple(range(1, machine.n + 1))

    def of(self: Kind, amount: float) -> Kind:
        """Returns the effect with another amount."""
        return replace(self, amount=amount)

    def part(self, ride: Ride) -> None:
        """Moves links relative to their motors, in place."""

    def torque(self, ride: Ride) -> np.ndarray | None:
        """Computes the additional motor torque (N, n) [N m]."""
        return None

    def load(self, ride: Ride) -> np.ndarray | None:
        """Computes the additional gear load (N, n) [N m], None for none."""
        return self.torque(ride) if self.loads_gears else None

    def signal(self, ride: Ride, torque: np.ndarray) -> np.ndarray:
        """Returns the logged torque (N, n) for a true torque (N, n), without noise."""
        return torque

    def position(self, ride: Ride) -> tuple[np.ndarray, np.ndarray, np.ndarray] | None:
        """Computes the error of the logged positions and its first two derivatives, each (N, n)."""
        return None

    def last(self, torque: np.ndarray) -> np.ndarray:
        """Returns the logged torque (N, n) for a torque with noise."""
        return torque

    def truths(self) -> dict[str, float]:
        """Returns true values of parameters that a diagnosis may state, by name."""
        return {}

    @property
    def j(self) -> int:
        """The joint, counted from 0."""
        return place_of(self.joint)

    def on_joint(self, ride: Ride, values: np.ndarray) -> np.ndarray:
        """Returns a torque (N, n) with values (N,) on the effect's joint, zero on all others."""
        torque = np.zeros_like(ride.q)
        torque[:, self.j] = values
        return torque


def place_of(joint: int | None) -> int:
    """Counts a joint from 0, instead of from 1."""
    assert joint is not None, "an effect of the whole robot has no joint"
    return joint - 1


def log_uniform(rng: np.random.Generator, lower: float, upper: float) -> float:
    """Draws a number whose logarithm is uniformly distributed."""
    return float(np.exp(rng.uniform(np.log(lower), np.log(upper))))

"""What an effect of the truth can do: part links from motors, add torque, falsify a signal."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from tests.truth.machines import Machine
from tests.truth.ride import Ride

Kind = TypeVar("Kind", bound="Effect")


@dataclass(frozen=True, kw_only=True)
class Effect:
    """An effect of a size ``amount`` on a joint (from 1), or on the whole robot (None)."""

    joint: int | None = None
    amount: float = 1.0

    name = ""
    smallest = 0.0
    largest = np.inf
    # How the visible size grows with the amount, for the search of the amount.
    power = 1.0
    lasting = True
    # Whether its torque passes the gears: what the robot carries, what pulls or pushes its links.
    borne = False

    @classmethod
    def draw(cls: type[Kind], machine: Machine, rng: np.random.Generator, joint: int | None, span: float) -> Kind:
        """Draws the effect's shape; ``span`` [s] is the duration of the logs it will be sought in."""
        return cls(joint=joint)

    @classmethod
    def joints(cls, machine: Machine) -> tuple[int | None, ...]:
        """Joints on which it can act."""
        return tuple(range(1, machine.n + 1))

    def of(self: Kind, amount: float) -> Kind:
        """The same effect, another amount."""
        return replace(self, amount=amount)

    def part(self, ride: Ride) -> None:
        """Parts links from motors."""

    def torque(self, ride: Ride) -> np.ndarray | None:
        """Extra torque (N, n) that the motors must give."""
        return None

    def load(self, ride: Ride) -> np.ndarray | None:
        """What of it gears feel as load (N, n) besides the robot's own."""
        return self.torque(ride) if self.borne else None

    def signal(self, ride: Ride, torque: np.ndarray) -> np.ndarray:
        """The torque as it is logged."""
        return torque

    def position(self, ride: Ride) -> tuple[np.ndarray, np.ndarray, np.ndarray] | None:
        """Error of the logged positions and its two derivatives, each (N, n)."""
        return None

    def last(self, torque: np.ndarray) -> np.ndarray:
        """The torque as it is logged, noise and all."""
        return torque

    def truths(self) -> dict[str, float]:
        """True values of parameters that a diagnosis may state, by plain names."""
        return {}

    @property
    def j(self) -> int:
        """The joint, counted from 0."""
        assert self.joint is not None
        return self.joint - 1

    def on_joint(self, ride: Ride, values: np.ndarray) -> np.ndarray:
        """A torque (N, n) of one joint's values (N,)."""
        torque = np.zeros_like(ride.q)
        torque[:, self.j] = values
        return torque


def log_uniform(rng: np.random.Generator, lower: float, upper: float) -> float:
    """Draws a number whose logarithm is uniform."""
    return float(np.exp(rng.uniform(np.log(lower), np.log(upper))))

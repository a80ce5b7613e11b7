"""One ride of a robot: what its motors and links really did, and the torque that took."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from scipy.ndimage import gaussian_filter1d

from tests.truth.dynamics import rigid_torque
from tests.truth.machines import Machine


@dataclass(kw_only=True)
class Ride:
    """All runs of a session, one after the other; time keeps running in the pauses between them.

    ``q, v, a`` are of the motors, seen at the joint; ``link_q, link_v, link_a`` of the links behind the gears: the same
    until an elastic or loose gear parts them. ``parts`` collects what each effect adds; ``carried`` is the torque that
    passes the gears besides the robot's own, None for none.
    """

    machine: Machine
    t: np.ndarray
    starts: tuple[int, ...]
    q: np.ndarray
    v: np.ndarray
    a: np.ndarray
    link_q: np.ndarray = None
    link_v: np.ndarray = None
    link_a: np.ndarray = None
    rigid: np.ndarray = None
    carried: np.ndarray | None = None
    parts: list[np.ndarray] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.link_q, self.link_v, self.link_a = self.q, self.v, self.a
        if self.rigid is None:
            self.rigid = rigid_torque(self.machine.model, self.q, self.v, self.a)

    @property
    def runs(self) -> list[slice]:
        """The samples of each run."""
        return [slice(a, b) for a, b in pairwise((*self.starts, len(self.t)))]

    @property
    def step(self) -> float:
        """The sample period [s]."""
        return float(self.t[1] - self.t[0])

    @property
    def sign(self) -> np.ndarray:
        """The smooth sign of the motors' velocities (N, n)."""
        return np.tanh(self.v / self.machine.sign_width)

    @property
    def load(self) -> np.ndarray:
        """Torque that the gears bear (N, n)."""
        return self.borne(self.rigid)

    def borne(self, rigid: np.ndarray) -> np.ndarray:
        """Adds what is carried to the robot's own torque (N, n)."""
        return rigid if self.carried is None else rigid + self.carried

    def friction(self) -> np.ndarray:
        """Friction of the base model (N, n)."""
        return friction_of(self.machine.friction, self.v, self.sign)

    def base_torque(self) -> np.ndarray:
        """Torque without any effect (N, n), for the motors' motion."""
        return self.rigid + self.machine.rotor * self.a + self.friction() + self.machine.offset

    def derivative(self, values: np.ndarray) -> np.ndarray:
        """Time derivative within each run."""
        result = np.zeros_like(values)
        for run in self.runs:
            result[run] = np.gradient(values[run], self.t[run], axis=0, edge_order=2)
        return result

    def smooth(self, values: np.ndarray, seconds: float) -> np.ndarray:
        """Gaussian low-pass within each run, without lag."""
        result = np.empty_like(values)
        for run in self.runs:
            result[run] = gaussian_filter1d(values[run], seconds / self.step, axis=0, mode="nearest")
        return result


def friction_of(friction: np.ndarray, v: np.ndarray, sign: np.ndarray) -> np.ndarray:
    """The friction polynomial (N, n)."""
    return friction[:, 0] * sign + friction[:, 1] * v + friction[:, 2] * v * np.abs(v) + friction[:, 3] * v**3

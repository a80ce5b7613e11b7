"""True motion of a robot's motors and links in one session, and its torque."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from scipy.ndimage import gaussian_filter1d

from oed.benchmarks.truth.dynamics import rigid_torque
from oed.benchmarks.truth.machines import Machine


@dataclass(kw_only=True)
class Ride:
    """All runs of a session, concatenated; time continues in the pauses between them.

    ``q, v, a`` (N, n) are the motion of the motors, referred to the joint. ``link_q, link_v, link_a`` are that of the
    links, which differs only with an elastic gear or backlash. ``rigid`` is the rigid-body torque of the motors'
    motion. ``parts`` collects the effects' torques. ``carried`` is additional gear load, None for none.
    """

    machine: Machine
    t: np.ndarray
    starts: tuple[int, ...]
    q: np.ndarray
    v: np.ndarray
    a: np.ndarray
    link_q: np.ndarray = field(default=None)  # type: ignore[arg-type]
    link_v: np.ndarray = field(default=None)  # type: ignore[arg-type]
    link_a: np.ndarray = field(default=None)  # type: ignore[arg-type]
    rigid: np.ndarray = field(default=None)  # type: ignore[arg-type]
    carried: np.ndarray | None = None
    parts: list[np.ndarray] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.link_q, self.link_v, self.link_a = self.q, self.v, self.a
        if self.rigid is None:
            self.rigid = rigid_torque(self.machine.model, self.q, self.v, self.a)

    @property
    def runs(self) -> list[slice]:
        """The rows of each run."""
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
        """The gear load (N, n) [N m]."""
        return self.with_gear_loads(self.rigid)

    def with_gear_loads(self, rigid: np.ndarray) -> np.ndarray:
        """Adds the additional gear load to a rigid-body torque (N, n) [N m]."""
        return rigid if self.carried is None else rigid + self.carried

    def friction(self) -> np.ndarray:
        """Evaluates the friction of the base model (N, n) [N m]."""
        return friction_of(self.machine.friction, self.v, self.sign)

    def base_torque(self) -> np.ndarray:
        """Evaluates the torque without any effect (N, n) [N m], for the motors' motion."""
        return self.rigid + self.machine.rotor * self.a + self.friction() + self.machine.offset

    def derivative(self, values: np.ndarray) -> np.ndarray:
        """Computes the time derivative (N, n) within each run."""
        result = np.zeros_like(values)
        for run in self.runs:
            result[run] = np.gradient(values[run], self.t[run], axis=0, edge_order=2)
        return result

    def smooth(self, values: np.ndarray, seconds: float) -> np.ndarray:
        """Filters values (N, n) by a Gaussian low-pass without lag, within each run."""
        result = np.empty_like(values)
        for run in self.runs:
            result[run] = gaussian_filter1d(values[run], seconds / self.step, axis=0, mode="nearest")
        return result


def friction_of(friction: np.ndarray, v: np.ndarray, sign: np.ndarray) -> np.ndarray:
    """Evaluates the friction polynomial (N, n) [N m] with coefficients (n, 4)."""
    return friction[:, 0] * sign + friction[:, 1] * v + friction[:, 2] * v * np.abs(v) + friction[:, 3] * v**3

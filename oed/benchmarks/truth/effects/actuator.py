"""Effects of motors and of logged signals."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline, PchipInterpolator

from oed.benchmarks.truth.effects.base import Effect
from oed.benchmarks.truth.machines import Machine
from oed.benchmarks.truth.ride import Ride


@dataclass(frozen=True, kw_only=True)
class TorqueConstant(Effect):
    """A wrong torque constant: one joint's torque is logged too large by the fraction `amount`."""

    name = "torque_constant_error"
    largest = 0.3

    def signal(self, ride: Ride, torque: np.ndarray) -> np.ndarray:
        return torque + self.on_joint(ride, self.amount * torque[:, self.j])


@dataclass(frozen=True, kw_only=True)
class Saturation(Effect):
    """Magnetic saturation: at the torque `top` the true torque is lower than current times constant, by `amount`.

    `amount` is a fraction. `top` is the largest torque of the first log, and the same in all other logs.
    """

    top: float = np.nan

    name = "torque_constant_saturation"
    largest = 0.35

    def signal(self, ride: Ride, torque: np.ndarray) -> np.ndarray:
        if np.isnan(self.top):
            object.__setattr__(self, "top", float(np.abs(torque[ride.runs[0], self.j]).max()))
        x = torque[:, self.j] / self.top
        # x = y / (1 + b y^2)^(1/4) with the logged torque y; at y = 1, x is smaller by the fraction `amount`.
        b = (1 - self.amount) ** -4 - 1
        y = np.sign(x) * np.sqrt(0.5 * (b * x**4 + np.sqrt(b**2 * x**8 + 4 * x**4)))
        return torque + self.on_joint(ride, self.top * (y - x))


@dataclass(frozen=True, kw_only=True)
class Clipping(Effect):
    """A current limit: `amount` is the fraction of the largest torque that is clipped."""

    limit: float = np.inf

    name = "current_clipping"
    largest = 0.6
    power = 1.5

    def signal(self, ride: Ride, torque: np.ndarray) -> np.ndarray:
        limit = (1 - self.amount) * np.abs(torque[ride.runs[0], self.j]).max()
        object.__setattr__(self, "limit", float(limit))
        clipped = torque.copy()
        clipped[:, self.j] = np.clip(torque[:, self.j], -limit, limit)
        return clipped

    def last(self, torque: np.ndarray) -> np.ndarray:
        clipped = torque.copy()
        clipped[:, self.j] = np.clip(torque[:, self.j], -self.limit, self.limit)
        return clipped

    def truths(self) -> dict[str, float]:
        return {"limit": self.limit}


@dataclass(frozen=True, kw_only=True)
class Drift(Effect):
    """A drifting torque zero, linear or as a random walk: `amount` [N m] per duration `span` [s]."""

    span: float = 60.0
    path: tuple[float, ...] = ()

    name = "torque_sensor_drift"
    lasting = False

    @classmethod
    def draw(cls, machine: Machine, rng: np.random.Generator, joint: int | None, span: float) -> Drift:
        path: tuple[float, ...] = ()
        if rng.random() < 0.5:
            walk = np.cumsum(rng.normal(size=200))
            path = tuple((walk / np.ptp(walk[:21])).tolist())
        return cls(joint=joint, span=span, path=path)

    def signal(self, ride: Ride, torque: np.ndarray) -> np.ndarray:
        if self.path:
            knots = np.arange(len(self.path)) * self.span / 20
            zero = PchipInterpolator(knots, np.array(self.path))(ride.t)
        else:
            zero = ride.t / self.span
        return torque + self.on_joint(ride, self.amount * zero)


@dataclass(frozen=True, kw_only=True)
class Delay(Effect):
    """A delay of `amount` [s] of the logged torque behind the position, equal on all joints."""

    name = "time_delay"
    largest = 0.02

    @classmethod
    def joints(cls, machine: Machine) -> tuple[int | None, ...]:
        return (None,)

    def signal(self, ride: Ride, torque: np.ndarray) -> np.ndarray:
        late = np.empty_like(torque)
        for run in ride.runs:
            clock = ride.t[run] - self.amount
            late[run] = CubicSpline(ride.t[run], torque[run])(np.maximum(clock, ride.t[run.start]))
        return late

    def truths(self) -> dict[str, float]:
        return {"delay": self.amount}


@dataclass(frozen=True, kw_only=True)
class EncoderOffset(Effect):
    """A wrong zero of a joint: the logged position is larger than the true one by `amount` [rad]."""

    name = "encoder_offset"
    largest = 0.15

    @classmethod
    def joints(cls, machine: Machine) -> tuple[int | None, ...]:
        return tuple(range(2, machine.n + 1))

    def position(self, ride: Ride) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        none = np.zeros_like(ride.q)
        return self.on_joint(ride, np.full(len(ride.t), self.amount)), none, none

    def truths(self) -> dict[str, float]:
        return {"offset": self.amount}

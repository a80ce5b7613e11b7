"""Effects on one joint that are not in the catalogue."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from oed.benchmarks.truth.dynamics import rigid_torque
from oed.benchmarks.truth.effects.base import Effect, log_uniform
from oed.benchmarks.truth.machines import Machine
from oed.benchmarks.truth.ride import Ride


@dataclass(frozen=True, kw_only=True)
class CrossWave(Effect):
    """amount cos(2 q_j) sin(1.5 q_k) on joint j, k its neighbour."""

    other: int = 1

    name = "unexplained"

    @classmethod
    def draw(cls, machine: Machine, rng: np.random.Generator, joint: int | None, span: float) -> CrossWave:
        return cls(joint=joint, other=_another(machine, rng, joint))

    def torque(self, ride: Ride) -> np.ndarray:
        wave = np.cos(2 * ride.q[:, self.j]) * np.sin(1.5 * ride.q[:, self.other - 1])
        return self.on_joint(ride, self.amount * wave)


@dataclass(frozen=True, kw_only=True)
class TiredCable(Effect):
    """A cable whose force relaxes: torque amount * x, x' = v - x / memory, with a memory in [s]."""

    memory: float = 0.8

    name = "unexplained"

    @classmethod
    def draw(cls, machine: Machine, rng: np.random.Generator, joint: int | None, span: float) -> TiredCable:
        return cls(joint=joint, memory=log_uniform(rng, 0.3, 1.2))

    def torque(self, ride: Ride) -> np.ndarray:
        keep = np.exp(-ride.step / self.memory)
        pull = np.zeros(len(ride.t))
        for run in ride.runs:
            pull[run] = lfilter([self.memory * (1 - keep)], [1, -keep], ride.v[run, self.j])
        return self.on_joint(ride, self.amount * pull)


@dataclass(frozen=True, kw_only=True)
class Interpolation(Effect):
    """An interpolation error of a joint-side encoder, 2^k periods per turn: `amount` [rad]."""

    order: int = 16
    phase: float = 0.0

    name = "unexplained"
    largest = 5e-3

    @classmethod
    def draw(cls, machine: Machine, rng: np.random.Generator, joint: int | None, span: float) -> Interpolation:
        return cls(joint=joint, order=int(2 ** rng.integers(3, 5)), phase=rng.uniform(0, 2 * np.pi))

    def position(self, ride: Ride) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        h = self.order
        angle, v, a = h * ride.q[:, self.j] + self.phase, ride.v[:, self.j], ride.a[:, self.j]
        s, c = np.sin(angle), np.cos(angle)
        first, second = -h * v * s, -h * a * s - (h * v) ** 2 * c
        error, rate, change = (self.on_joint(ride, self.amount * values) for values in (c, first, second))
        return error, rate, change


@dataclass(frozen=True, kw_only=True)
class Drag(Effect):
    """amount |v_k| v_k cos(q_j + phase) on joint j: drag by another joint's velocity that depends on the position."""

    other: int = 1
    phase: float = 0.0

    name = "unexplained"

    @classmethod
    def draw(cls, machine: Machine, rng: np.random.Generator, joint: int | None, span: float) -> Drag:
        return cls(joint=joint, other=_another(machine, rng, joint), phase=rng.uniform(0, 2 * np.pi))

    def torque(self, ride: Ride) -> np.ndarray:
        v = ride.v[:, self.other - 1]
        return self.on_joint(ride, self.amount * np.abs(v) * v * np.cos(ride.q[:, self.j] + self.phase))


@dataclass(frozen=True, kw_only=True)
class BorrowedFriction(Effect):
    """Friction amount |v_k| / (|v_k| + v0) on joint j by another joint's speed, as with shared seals."""

    other: int = 1

    name = "unexplained"

    @classmethod
    def draw(cls, machine: Machine, rng: np.random.Generator, joint: int | None, span: float) -> BorrowedFriction:
        return cls(joint=joint, other=_another(machine, rng, joint))

    def torque(self, ride: Ride) -> np.ndarray:
        k = self.other - 1
        speed = np.abs(ride.v[:, k])
        size = speed / (speed + 0.2 * ride.machine.speed[k])
        return self.on_joint(ride, self.amount * size * ride.sign[:, self.j])


@dataclass(frozen=True, kw_only=True)
class DraggingBrake(Effect):
    """A brake that drags with `amount` [N m] during two fifths of the time."""

    every: float = 15.0

    name = "unexplained"
    lasting = False

    @classmethod
    def draw(cls, machine: Machine, rng: np.random.Generator, joint: int | None, span: float) -> DraggingBrake:
        return cls(joint=joint, every=span * rng.uniform(0.15, 0.5))

    def torque(self, ride: Ride) -> np.ndarray:
        drags = np.mod(ride.t / self.every, 1.0) < 0.4
        return self.on_joint(ride, self.amount * drags * ride.sign[:, self.j])


@dataclass(frozen=True, kw_only=True)
class BeltFriction(Effect):
    """Friction amount sin(2 pi f t + phase) of a part that rotates independently, such as the belt of a fan."""

    frequency: float = 0.5
    phase: float = 0.0

    name = "unexplained"
    lasting = False

    @classmethod
    def draw(cls, machine: Machine, rng: np.random.Generator, joint: int | None, span: float) -> BeltFriction:
        return cls(joint=joint, frequency=log_uniform(rng, 0.15, 1.5), phase=rng.uniform(0, 2 * np.pi))

    def torque(self, ride: Ride) -> np.ndarray:
        size = np.sin(2 * np.pi * self.frequency * ride.t + self.phase)
        return self.on_joint(ride, self.amount * size * ride.sign[:, self.j])


@dataclass(frozen=True, kw_only=True)
class DeadZone(Effect):
    """A dead zone of a torque signal: `amount` is its half width as a fraction of the first log's largest torque."""

    name = "unexplained"
    largest = 0.5

    def signal(self, ride: Ride, torque: np.ndarray) -> np.ndarray:
        own = torque[:, self.j]
        zone = self.amount * np.abs(own[ride.runs[0]]).max()
        return torque + self.on_joint(ride, -np.clip(own, -zone, zone))


@dataclass(frozen=True, kw_only=True)
class SlippedZero(Effect):
    """A joint zero that changes at one time: the true position is then larger than logged, by `amount` [rad or m]."""

    moment: float = 0.0

    name = "unexplained"
    largest = 0.5

    @classmethod
    def joints(cls, machine: Machine) -> tuple[int | None, ...]:
        return tuple(range(2, machine.n + 1))

    @classmethod
    def draw(cls, machine: Machine, rng: np.random.Generator, joint: int | None, span: float) -> SlippedZero:
        return cls(joint=joint, moment=span * rng.uniform(0.2, 0.8))

    def torque(self, ride: Ride) -> np.ndarray:
        model, q = ride.machine.model, ride.link_q + self.on_joint(ride, np.full(len(ride.t), self.amount))
        there, logged = (rigid_torque(model, x, ride.link_v, ride.link_a) for x in (q, ride.link_q))
        return (ride.t >= self.moment)[:, None] * (there - logged)

    def truths(self) -> dict[str, float]:
        return {"change_time": self.moment}


def _another(machine: Machine, rng: np.random.Generator, joint: int | None) -> int:
    """Draws a joint (from 1) other than a given one."""
    return int(rng.choice([k for k in range(1, machine.n + 1) if k != joint]))

"""Friction effects beyond the friction polynomial."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm

from oed.benchmarks.truth.effects.base import Effect, log_uniform, place_of
from oed.benchmarks.truth.machines import Machine
from oed.benchmarks.truth.ride import Ride


@dataclass(frozen=True, kw_only=True)
class Stribeck(Effect):
    """Stribeck friction, amount exp(-(|v|/speed)^exponent) sign(v): amount [N m]."""

    speed: float = 0.05
    exponent: float = 1.0

    name = "stribeck"

    @classmethod
    def draw(cls, machine: Machine, rng: np.random.Generator, joint: int | None, span: float) -> Stribeck:
        """Draws speed and exponent."""
        top = machine.speed[place_of(joint)]
        return cls(joint=joint, speed=top * log_uniform(rng, 0.015, 0.1), exponent=rng.uniform(0.8, 2.0))

    def torque(self, ride: Ride) -> np.ndarray:
        v = ride.v[:, self.j]
        return self.on_joint(
            ride, self.amount * np.exp(-((np.abs(v) / self.speed) ** self.exponent)) * ride.sign[:, self.j]
        )

    def truths(self) -> dict[str, float]:
        return {"stribeck_velocity": self.speed, "stribeck_torque": self.amount}


@dataclass(frozen=True, kw_only=True)
class LuGre(Effect):
    """Presliding by the LuGre model: `amount` is the presliding travel [rad]."""

    damping: float = 0.02

    name = "presliding_hysteresis"
    smallest = 1e-4
    largest = 0.05
    power = 0.7

    @classmethod
    def draw(cls, machine: Machine, rng: np.random.Generator, joint: int | None, span: float) -> LuGre:
        return cls(joint=joint, damping=rng.uniform(0.0, 0.05))

    def torque(self, ride: Ride) -> np.ndarray:
        coulomb = ride.machine.friction[self.j, 0]
        v = ride.v[:, self.j]
        bent = np.empty(len(v))
        for run in ride.runs:
            bent[run] = _bristles(v[run], ride.step, self.amount)
        rate = v * (1.0 - np.sign(v) * bent)
        return self.on_joint(ride, coulomb * (bent + self.damping * rate / np.abs(v).max() - ride.sign[:, self.j]))

    def truths(self) -> dict[str, float]:
        return {"presliding_distance": self.amount}


def _bristles(v: np.ndarray, step: float, reach: float) -> np.ndarray:
    """Solves z' = v - |v| z / reach for z / reach, exactly for a velocity that is constant within each sub-step."""
    substeps = 4
    weight = np.arange(1, substeps + 1) / substeps
    before = np.concatenate([v[:1], v[:-1]])
    fine = (before[:, None] + (v - before)[:, None] * weight).ravel()
    decay = np.exp(-np.abs(fine) * step / substeps / reach)
    target = np.sign(fine) * (1.0 - decay)
    z, result = float(np.sign(v[0])), np.empty(len(fine))
    for k, (keep, gain) in enumerate(zip(decay.tolist(), target.tolist(), strict=True)):
        z = keep * z + gain
        result[k] = z
    return result[substeps - 1 :: substeps]


@dataclass(frozen=True, kw_only=True)
class Asymmetric(Effect):
    """Viscous friction that differs between both directions: `amount` [N m s/rad] is half the difference."""

    bend: float = 0.0

    name = "asymmetric_friction"

    @classmethod
    def draw(cls, machine: Machine, rng: np.random.Generator, joint: int | None, span: float) -> Asymmetric:
        return cls(joint=joint, bend=rng.uniform(-0.3, 0.3))

    def torque(self, ride: Ride) -> np.ndarray:
        v = ride.v[:, self.j]
        top = ride.machine.speed[self.j]
        forward = np.where(v > 0, v, 0.0)
        backward = np.where(v < 0, v, 0.0)
        return self.on_joint(ride, self.amount * (forward - backward) * (1 + self.bend * np.abs(v) / top))


@dataclass(frozen=True, kw_only=True)
class LoadDependent(Effect):
    """Gear losses that grow with the load: `amount` is 1/efficiency - 1 while the joint drives its load.

    `back` is the ratio of the losses while the load drives the joint.
    """

    back: float = 0.7

    name = "load_dependent_friction"
    largest = 0.4

    @classmethod
    def draw(cls, machine: Machine, rng: np.random.Generator, joint: int | None, span: float) -> LoadDependent:
        return cls(joint=joint, back=rng.uniform(0.4, 1.0))

    def torque(self, ride: Ride) -> np.ndarray:
        load, v = ride.load[:, self.j], ride.v[:, self.j]
        driving = load * v > 0
        loss = np.where(driving, self.amount, self.amount * self.back) * np.abs(load)
        return self.on_joint(ride, loss * ride.sign[:, self.j])

    def truths(self) -> dict[str, float]:
        return {"driven_back": self.back}


@dataclass(frozen=True, kw_only=True)
class PositionDependent(Effect):
    """Friction that varies over a turn of the joint, as with an eccentric part: `amount` [N m] is the amplitude."""

    order: int = 1
    phase: float = 0.0
    second: float = 0.15

    name = "position_dependent_friction"

    @classmethod
    def draw(cls, machine: Machine, rng: np.random.Generator, joint: int | None, span: float) -> PositionDependent:
        return cls(
            joint=joint, order=int(rng.integers(1, 3)), phase=rng.uniform(0, 2 * np.pi), second=rng.uniform(0, 0.2)
        )

    def torque(self, ride: Ride) -> np.ndarray:
        angle = self.order * ride.q[:, self.j] + self.phase
        shape = np.cos(angle) + self.second * np.cos(2 * angle)
        return self.on_joint(ride, self.amount * shape * ride.sign[:, self.j])


@dataclass(frozen=True, kw_only=True)
class FrictionStep(Effect):
    """Damage at one time: friction increases by the fraction `amount`, within 30 ms."""

    moment: float = 0.0
    viscous: float = 1.0

    name = "friction_step"
    largest = 2.0

    @classmethod
    def draw(cls, machine: Machine, rng: np.random.Generator, joint: int | None, span: float) -> FrictionStep:
        return cls(joint=joint, moment=span * rng.uniform(0.2, 0.8), viscous=rng.uniform(0.3, 1.0))

    def torque(self, ride: Ride) -> np.ndarray:
        since = np.clip((ride.t - self.moment) / 0.03, 0.0, 1.0)
        f1, f2 = ride.machine.friction[self.j, :2]
        plain = f1 * ride.sign[:, self.j] + self.viscous * f2 * ride.v[:, self.j]
        return self.on_joint(ride, self.amount * since * plain)

    def truths(self) -> dict[str, float]:
        return {"change_time": self.moment}


@dataclass(frozen=True, kw_only=True)
class Warming(Effect):
    """Two heat nodes, gear and housing: friction falls by the fraction `amount` per unit of gear heat.

    One unit is the steady-state heat, without exchange, for the mean friction power of the first run.
    """

    fast: float = 60.0
    slow: float = 900.0
    exchange: float = 0.6
    coulomb: float = 0.4

    name = "thermal_friction"
    largest = 6.0

    @classmethod
    def draw(cls, machine: Machine, rng: np.random.Generator, joint: int | None, span: float) -> Warming:
        return cls(
            joint=joint,
            fast=log_uniform(rng, 0.25 * span, 1.0 * span),
            slow=log_uniform(rng, 8.0 * span, 20.0 * span),
            exchange=rng.uniform(0.5, 0.8),
            coulomb=rng.uniform(0.1, 0.8),
        )

    def torque(self, ride: Ride) -> np.ndarray:
        f1, f2 = ride.machine.friction[self.j, :2]
        v, sign = ride.v[:, self.j], ride.sign[:, self.j]
        power = (f1 * sign + f2 * v) * v
        reference = power[ride.runs[0]].mean()
        heat = self._heat(ride, power / reference)
        return self.on_joint(ride, -self.amount * heat * (self.coulomb * f1 * sign + f2 * v))

    def _heat(self, ride: Ride, power: np.ndarray) -> np.ndarray:
        # Gear: fast x' = p - x + exchange y; housing: slow y' = x - y. Both cold at the start of the session.
        rates = np.array([[-1.0, self.exchange], [1.0, -1.0]]) / np.array([[self.fast], [self.slow]])
        state, clock = np.zeros(2), ride.t[0]
        heat = np.empty(len(ride.t))
        for run in ride.runs:
            state = expm(rates * max(ride.t[run.start] - clock, 0.0)) @ state
            stride = max(round(0.1 / ride.step), 1)
            edges = np.arange(run.start, run.stop, stride)
            whole = expm(
                np.block([[rates, np.array([[1.0 / self.fast], [0.0]])], [np.zeros((1, 3))]]) * stride * ride.step
            )
            nodes = np.empty((len(edges), 2))
            for k, edge in enumerate(edges):
                nodes[k] = state
                mean = power[edge : edge + stride].mean()
                state = whole[:2, :2] @ state + whole[:2, 2] * mean
            heat[run] = np.interp(np.arange(run.start, run.stop), edges, nodes[:, 0])
            clock = ride.t[run.stop - 1]
        return heat

    def truths(self) -> dict[str, float]:
        return {"time_constant": self.fast}

"""Gears that ripple, give way, have play, or drive one another."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from tests.truth.dynamics import rigid_torque
from tests.truth.effects.base import Effect, log_uniform
from tests.truth.machines import Machine
from tests.truth.ride import Ride

TRANSIT_LIMITS = (0.006, 0.05)
LOADED = 0.1  # share of a joint's torque RMS below which its load is none


@dataclass(frozen=True, kw_only=True)
class Ripple(Effect):
    """Torque that waves with the motor's angle: amount [N m], part of it growing with the load."""

    order: float = 2.0
    gear: float = 100.0
    phase: float = 0.0
    loaded: float = 0.3

    name = "torque_ripple"

    @classmethod
    def draw(cls, machine: Machine, rng: np.random.Generator, joint: int | None, span: float) -> Ripple:
        order = float(rng.choice([1.0, 2.0, 4.0]))
        gear = float(machine.gear[joint - 1])
        return cls(joint=joint, order=order, gear=gear, phase=rng.uniform(0, 2 * np.pi), loaded=rng.uniform(0.0, 0.4))

    def torque(self, ride: Ride) -> np.ndarray:
        angle = self.order * self.gear * ride.q[:, self.j] + self.phase
        load, first = ride.load[:, self.j], ride.runs[0]
        # Of a joint that carries next to nothing, teeth mesh no harder for what rounding makes of its load.
        whole = np.sqrt((ride.base_torque()[first, self.j] ** 2).mean())
        share = load / max(np.sqrt((load[first] ** 2).mean()), LOADED * whole)
        wave = np.cos(angle) * (1 - self.loaded + self.loaded * share)
        return self.on_joint(ride, self.amount * wave)

    def truths(self) -> dict[str, float]:
        return {"order": self.order * self.gear}


@dataclass(frozen=True, kw_only=True)
class Elastic(Effect):
    """A gear that twists by torque * amount (a compliance [rad/(N m)]), a little softer at small loads.

    The robot is flat: from the link's motion follow the torque through the gear, from that the twist and the motor's
    motion. So the two-inertia equations hold exactly.
    """

    soft: float = 0.0

    name = "joint_elasticity"
    largest = 3e-4

    @classmethod
    def draw(cls, machine: Machine, rng: np.random.Generator, joint: int | None, span: float) -> Elastic:
        return cls(joint=joint, soft=rng.uniform(0.0, 0.15))

    def part(self, ride: Ride) -> None:
        through = rigid_torque(ride.machine.model, ride.link_q, ride.link_v, ride.link_a)
        through = ride.smooth(ride.borne(through), 0.004)[:, self.j]
        level = np.sqrt((through[ride.runs[0]] ** 2).mean())
        twist = self.amount * (through + self.soft * level * np.tanh(through / level))
        rate = ride.derivative(twist)
        for name, change in (("q", twist), ("v", rate), ("a", ride.derivative(rate))):
            setattr(ride, name, getattr(ride, name) + self.on_joint(ride, change))

    def truths(self) -> dict[str, float]:
        return {"stiffness": 1.0 / self.amount}


@dataclass(frozen=True, kw_only=True)
class Backlash(Effect):
    """Play of amount [rad]: the link changes sides when the torque through the gear changes sign.

    The crossing takes as long as the growing torque needs to carry the link's inertia over the gap.
    """

    name = "backlash"
    largest = 6e-3
    power = 0.7

    def part(self, ride: Ride) -> None:
        machine = ride.machine
        through = ride.borne(rigid_torque(machine.model, ride.q, ride.v, ride.a))[:, self.j]
        rate = ride.derivative(through)
        data = machine.model.createData()
        side, side1, side2 = (np.zeros(len(through)) for _ in range(3))
        for run in ride.runs:
            side[run] = np.sign(through[run.start]) or 1.0
            crossings = run.start + 1 + np.flatnonzero(np.diff(np.sign(through[run])) != 0)
            for k in crossings:
                new = float(np.sign(through[min(k + 1, run.stop - 1)])) or 1.0
                if side[k] == new:
                    continue
                pin.crba(machine.model, data, ride.q[k])
                inertia = data.M[self.j, self.j]
                seconds = (6 * self.amount * inertia / max(abs(rate[k]), 1e-3)) ** (1 / 3)
                seconds = float(np.clip(seconds, *TRANSIT_LIMITS))
                last = min(run.stop, k + max(round(seconds / ride.step), 2))
                s = (ride.t[k:last] - ride.t[k]) / seconds
                jump = new - side[k]
                start = side[k]
                side[k : run.stop] = new
                side[k:last] = start + jump * (10 * s**3 - 15 * s**4 + 6 * s**5)
                side1[k : run.stop], side2[k : run.stop] = 0.0, 0.0
                side1[k:last] = jump * (30 * s**2 - 60 * s**3 + 30 * s**4) / seconds
                side2[k:last] = jump * (60 * s - 180 * s**2 + 120 * s**3) / seconds**2
        half = self.amount / 2
        for name, change in (("link_q", side), ("link_v", side1), ("link_a", side2)):
            setattr(ride, name, getattr(ride, name) - self.on_joint(ride, half * change))

    def truths(self) -> dict[str, float]:
        return {"play": self.amount}


@dataclass(frozen=True, kw_only=True)
class WristCoupling(Effect):
    """Two wrist gears that drive one another: friction of the sum of speeds, and a common inertia; amount [N m]."""

    viscous: float = 1.0
    inertia: float = 0.05

    name = "joint_coupling"

    @classmethod
    def joints(cls, machine: Machine) -> tuple[int | None, ...]:
        return (machine.wrist[1],)

    @classmethod
    def draw(cls, machine: Machine, rng: np.random.Generator, joint: int | None, span: float) -> WristCoupling:
        f1, f2 = machine.friction[joint - 1, :2]
        return cls(joint=joint, viscous=float(f2 / f1 * rng.uniform(0.3, 1.0)), inertia=log_uniform(rng, 0.01, 0.05))

    def torque(self, ride: Ride) -> np.ndarray:
        first, second = (joint - 1 for joint in ride.machine.wrist)
        both = np.tanh((ride.v[:, first] + ride.v[:, second]) / ride.machine.sign_width[first])
        torque = np.zeros_like(ride.q)
        for joint, other in ((first, second), (second, first)):
            own = ride.sign[:, joint]
            torque[:, joint] = both - own + self.viscous * ride.v[:, other] + self.inertia * ride.a[:, other]
        return self.amount * torque


@dataclass(frozen=True, kw_only=True)
class Balancer(Effect):
    """A spring between the carousel and the upper arm: amount [N/m], on two levers; a gas spring gets stiffer."""

    lever: tuple[float, float] = (0.1, 0.4)
    angle: float = 0.5
    slack: float = 0.8
    gas: float = 0.0

    name = "spring"
    borne = True

    @classmethod
    def joints(cls, machine: Machine) -> tuple[int | None, ...]:
        return (2, 3)

    @classmethod
    def draw(cls, machine: Machine, rng: np.random.Generator, joint: int | None, span: float) -> Balancer:
        return cls(
            joint=joint,
            lever=(rng.uniform(0.08, 0.2), rng.uniform(0.3, 0.5)),
            angle=rng.uniform(-0.6, 0.6) + np.pi,
            slack=rng.uniform(0.6, 0.95),
            gas=float(rng.choice([0.0, 1.3])),
        )

    def torque(self, ride: Ride) -> np.ndarray:
        a, b = self.lever
        angle = ride.q[:, self.j] + self.angle
        length = np.sqrt(a**2 + b**2 - 2 * a * b * np.cos(angle))
        longest, shortest = a + b, b - a
        stretch = length - self.slack * shortest
        if self.gas:
            room = 1.0 - 0.75 * (length - shortest) / (longest - shortest)
            stretch = 0.3 * room**-self.gas
        return self.on_joint(ride, self.amount * stretch * a * b * np.sin(angle) / length)


@dataclass(frozen=True, kw_only=True)
class Cable(Effect):
    """A hose that pulls a joint back, harder towards the ends: amount [N m/rad]."""

    centre: float = 0.0
    cubic: float = 0.5

    name = "spring"
    borne = True

    @classmethod
    def joints(cls, machine: Machine) -> tuple[int | None, ...]:
        return (1, *range(4, machine.n + 1))

    @classmethod
    def draw(cls, machine: Machine, rng: np.random.Generator, joint: int | None, span: float) -> Cable:
        return cls(joint=joint, centre=rng.uniform(-0.4, 0.4), cubic=log_uniform(rng, 0.2, 2.0))

    def torque(self, ride: Ride) -> np.ndarray:
        off = ride.q[:, self.j] - self.centre
        return self.on_joint(ride, self.amount * (off + self.cubic * off**3))

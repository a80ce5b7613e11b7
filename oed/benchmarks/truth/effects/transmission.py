"""Effects of gears and joints: ripple, elasticity, backlash, coupling, springs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from oed.benchmarks.truth.dynamics import rigid_torque
from oed.benchmarks.truth.effects.base import Effect, log_uniform, place_of
from oed.benchmarks.truth.machines import Machine
from oed.benchmarks.truth.ride import Ride


@dataclass(frozen=True, kw_only=True)
class Ripple(Effect):
    """Torque ripple with the motor's angle: `amount` [N m], part of it proportional to the load."""

    order: float = 2.0
    gear: float = 100.0
    phase: float = 0.0
    loaded: float = 0.3

    name = "torque_ripple"

    @classmethod
    def draw(cls, machine: Machine, rng: np.random.Generator, joint: int | None, span: float) -> Ripple:
        order = float(rng.choice([1.0, 2.0, 4.0]))
        gear = float(machine.gear[place_of(joint)])
        return cls(joint=joint, order=order, gear=gear, phase=rng.uniform(0, 2 * np.pi), loaded=rng.uniform(0.0, 0.4))

    def torque(self, ride: Ride) -> np.ndarray:
        angle = self.order * self.gear * ride.q[:, self.j] + self.phase
        load, first = ride.load[:, self.j], ride.runs[0]
        # Without the lower bound, rounding of a load near zero would scale the ripple.
        whole = np.sqrt((ride.base_torque()[first, self.j] ** 2).mean())
        # The load that scales the ripple has at least a tenth of the joint's torque, as RMS.
        share = load / max(np.sqrt((load[first] ** 2).mean()), 0.1 * whole)
        wave = np.cos(angle) * (1 - self.loaded + self.loaded * share)
        return self.on_joint(ride, self.amount * wave)

    def truths(self) -> dict[str, float]:
        return {"order": self.order * self.gear}


@dataclass(frozen=True, kw_only=True)
class Elastic(Effect):
    """An elastic gear with the compliance `amount` [rad/(N m)], slightly softer at small loads.

    The system is differentially flat: the link's motion gives the torque through the gear, the deflection, and so the
    motor's motion. The two-inertia equations therefore hold exactly.
    """

    soft: float = 0.0

    name = "joint_elasticity"
    largest = 3e-4

    @classmethod
    def draw(cls, machine: Machine, rng: np.random.Generator, joint: int | None, span: float) -> Elastic:
        return cls(joint=joint, soft=rng.uniform(0.0, 0.15))

    def part(self, ride: Ride) -> None:
        through = rigid_torque(ride.machine.model, ride.link_q, ride.link_v, ride.link_a)
        through = ride.smooth(ride.with_gear_loads(through), 0.004)[:, self.j]
        level = np.sqrt((through[ride.runs[0]] ** 2).mean())
        twist = self.amount * (through + self.soft * level * np.tanh(through / level))
        rate = ride.derivative(twist)
        for name, change in (("q", twist), ("v", rate), ("a", ride.derivative(rate))):
            setattr(ride, name, getattr(ride, name) + self.on_joint(ride, change))

    def truths(self) -> dict[str, float]:
        return {"stiffness": 1.0 / self.amount}


@dataclass(frozen=True, kw_only=True)
class Backlash(Effect):
    """Backlash of `amount` [rad]: link and motor are two bodies with a dead zone between elastic teeth.

    The motor keeps its motion. When the torque through the gear changes sign, the link crosses the gap and hits the
    other teeth, which act as a damped spring; it may rebound. M x'' = torque - teeth(x), from rest on the first flank.

    ``swing`` [Hz] is the natural frequency of the link on the teeth, and ``damping`` its damping ratio.
    """

    swing: float = 40.0
    damping: float = 0.3

    name = "backlash"
    largest = 6e-3
    power = 0.7

    @classmethod
    def draw(cls, machine: Machine, rng: np.random.Generator, joint: int | None, span: float) -> Backlash:
        return cls(joint=joint, swing=log_uniform(rng, 15.0, 60.0), damping=rng.uniform(0.2, 0.7))

    def part(self, ride: Ride) -> None:
        through = ride.with_gear_loads(rigid_torque(ride.machine.model, ride.q, ride.v, ride.a))[:, self.j]
        behind = np.zeros((3, len(through)))  # position of the motor minus that of the link, and two derivatives
        for run in ride.runs:
            behind[:, run] = self._floating(ride, run, through[run])
        for name, change in zip(("link_q", "link_v", "link_a"), behind, strict=True):
            setattr(ride, name, getattr(ride, name) - self.on_joint(ride, change))

    def _floating(self, ride: Ride, run: slice, through: np.ndarray) -> np.ndarray:
        """Simulates the motor's position minus the link's in a run, with two derivatives (3, N)."""
        # A link that has landed comes to rest within 0.3 s.
        half, settles = self.amount / 2, round(0.3 / ride.step)
        signs = np.where(through >= 0, 1.0, -1.0)
        behind = np.zeros((3, len(through)))
        behind[0] = half * signs
        crossings = np.flatnonzero(np.diff(signs) != 0)
        starts = crossings[np.diff(crossings, prepend=-settles) >= settles]
        if not len(starts):
            return behind
        # If the load changes sign again before the link has settled, the simulation goes on; the longest one counts.
        last = [crossings[crossings < end][-1] for end in (*starts[1:], len(through))]
        length = int(np.max(np.subtract(last, starts))) + settles
        data, model = ride.machine.model.createData(), ride.machine.model
        inertia = np.array([pin.crba(model, data, ride.q[run.start + k])[self.j, self.j] for k in starts])
        stiff, damp = inertia * (2 * np.pi * self.swing) ** 2, 2 * self.damping * inertia * 2 * np.pi * self.swing
        # A link within the backlash is integrated in steps of 0.2 ms at most.
        x, v, times = half * signs[starts], np.zeros(len(starts)), max(1, round(ride.step / 2e-4))
        step = ride.step / times
        for k in range(min(length, len(through))):
            at = np.minimum(starts + k, len(through) - 1)
            force = through[at]
            grows = (through[np.minimum(at + 1, len(through) - 1)] - force) / times
            for fine in range(times):
                deep = np.sign(x) * np.maximum(np.abs(x) - half, 0.0)
                push = np.where(deep != 0, stiff * deep + damp * v, 0.0)
                # Teeth can push, but not pull.
                push = np.where(push * deep > 0, push, 0.0)
                a = (force + fine * grows - push) / inertia
                if fine == 0:
                    own = (starts + k < len(through)) & (starts + k < np.append(starts[1:], len(through)))
                    behind[:, at[own]] = x[own], v[own], a[own]
                v = v + step * a
                x = x + step * v
        return behind

    def truths(self) -> dict[str, float]:
        return {"play": self.amount}


@dataclass(frozen=True, kw_only=True)
class WristCoupling(Effect):
    """Two coupled wrist joints: friction of the sum of both velocities, and a coupled inertia; `amount` [N m]."""

    viscous: float = 1.0
    inertia: float = 0.05

    name = "joint_coupling"

    @classmethod
    def joints(cls, machine: Machine) -> tuple[int | None, ...]:
        return (machine.wrist[1],)

    @classmethod
    def draw(cls, machine: Machine, rng: np.random.Generator, joint: int | None, span: float) -> WristCoupling:
        f1, f2 = machine.friction[place_of(joint), :2]
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
    """A balancer, a spring on two levers between two links: `amount` [N/m]; a gas spring is progressive."""

    lever: tuple[float, float] = (0.1, 0.4)
    angle: float = 0.5
    slack: float = 0.8
    gas: float = 0.0

    name = "spring"
    loads_gears = True

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
    """A progressive spring towards a centre, as with a hose: `amount` [N m/rad]."""

    centre: float = 0.0
    cubic: float = 0.5

    name = "spring"
    loads_gears = True

    @classmethod
    def joints(cls, machine: Machine) -> tuple[int | None, ...]:
        return (1, *range(4, machine.n + 1))

    @classmethod
    def draw(cls, machine: Machine, rng: np.random.Generator, joint: int | None, span: float) -> Cable:
        return cls(joint=joint, centre=rng.uniform(-0.4, 0.4), cubic=log_uniform(rng, 0.2, 2.0))

    def torque(self, ride: Ride) -> np.ndarray:
        off = ride.q[:, self.j] - self.centre
        return self.on_joint(ride, self.amount * (off + self.cubic * off**3))

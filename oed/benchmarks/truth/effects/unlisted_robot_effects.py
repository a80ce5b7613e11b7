"""Effects on all joints at once that are not in the catalogue."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from scipy.signal import lfilter

from oed.benchmarks.truth.dynamics import point_force_torque, rigid_torque, with_gravity
from oed.benchmarks.truth.effects.base import Effect, log_uniform
from oed.benchmarks.truth.machines import Machine
from oed.benchmarks.truth.ride import Ride


@dataclass(frozen=True, kw_only=True)
class FloorVibration(Effect):
    """A floor that vibrates along a line: `amount` [m/s2] at one frequency [Hz]."""

    frequency: float = 6.0
    direction: tuple[float, float, float] = (1.0, 0.0, 0.0)
    phase: float = 0.0

    name = "unexplained"
    largest = 20.0

    @classmethod
    def joints(cls, machine: Machine) -> tuple[int | None, ...]:
        return (None,)

    @classmethod
    def draw(cls, machine: Machine, rng: np.random.Generator, joint: int | None, span: float) -> FloorVibration:
        direction = rng.normal(size=3)
        return cls(
            frequency=rng.uniform(2.0, 9.0),
            direction=tuple((direction / np.linalg.norm(direction)).tolist()),
            phase=rng.uniform(0, 2 * np.pi),
        )

    def torque(self, ride: Ride) -> np.ndarray:
        field = with_gravity(ride.machine.model, -np.array(self.direction))
        still = np.zeros_like(ride.q)
        shake = np.cos(2 * np.pi * self.frequency * ride.t + self.phase)
        return self.amount * shake[:, None] * rigid_torque(field, ride.link_q, still, still)


@dataclass(frozen=True, kw_only=True)
class Slosh(Effect):
    """Liquid in a tank at the flange: a mass `amount` [kg] on weak springs, excited by the flange's acceleration."""

    frequency: float = 1.5
    damping: float = 0.05

    name = "unexplained"
    largest = 100.0

    @classmethod
    def joints(cls, machine: Machine) -> tuple[int | None, ...]:
        return (None,)

    @classmethod
    def draw(cls, machine: Machine, rng: np.random.Generator, joint: int | None, span: float) -> Slosh:
        return cls(frequency=rng.uniform(0.8, 2.5), damping=log_uniform(rng, 0.02, 0.1))

    def torque(self, ride: Ride) -> np.ndarray:
        machine, point = ride.machine, np.array([0.0, 0.0, 0.1])
        every = _thinning(ride)
        place = _places(machine, ride.link_q, point)
        w, force = 2 * np.pi * self.frequency, np.zeros((len(ride.t), 3))
        h = ride.step
        # x'' + 2 d w x' + w^2 x = -p'' in the horizontal plane, by the bilinear rule; its force is w^2 x + 2 d w x'.
        k = 2 / h
        den = np.array(
            [k**2 + 2 * self.damping * w * k + w**2, 2 * w**2 - 2 * k**2, k**2 - 2 * self.damping * w * k + w**2]
        )
        num = np.array([2 * self.damping * w * k + w**2, 2 * w**2, w**2 - 2 * self.damping * w * k])
        for run in ride.runs:
            speed = np.gradient(place[run], h, axis=0)
            pull = np.gradient(speed, h, axis=0)
            force[run, :2] = lfilter(num, den, -pull[:, :2], axis=0)
        force[np.arange(len(force)) % every > 0] = 0.0
        torque = point_force_torque(machine.model, ride.link_q, machine.n, point, self.amount * force)
        rows = np.arange(0, len(force), every)
        return np.column_stack([np.interp(np.arange(len(force)), rows, column) for column in torque[rows].T])


@dataclass(frozen=True, kw_only=True)
class Hose(Effect):
    """A dress pack from the ceiling to the flange with the stiffness `amount` [N/m], which pulls only when taut."""

    anchor: tuple[float, float, float] = (0.0, 0.0, 2.0)
    slack: float = 0.5

    name = "unexplained"
    largest = 1e5

    @classmethod
    def joints(cls, machine: Machine) -> tuple[int | None, ...]:
        return (None,)

    @classmethod
    def draw(cls, machine: Machine, rng: np.random.Generator, joint: int | None, span: float) -> Hose:
        middle = (machine.lower + machine.upper)[None] / 2
        size = float(np.linalg.norm(_places(machine, middle, np.zeros(3))))
        place = (rng.uniform(-0.3, 0.3), rng.uniform(-0.3, 0.3), rng.uniform(0.8, 1.6))
        return cls(anchor=(size * place[0], size * place[1], size * place[2]), slack=size * rng.uniform(0.2, 0.5))

    def torque(self, ride: Ride) -> np.ndarray:
        every = _thinning(ride)
        q = ride.link_q[::every]
        reach = np.array(self.anchor) - _places(ride.machine, q, np.zeros(3))
        length = np.linalg.norm(reach, axis=1, keepdims=True)
        force = self.amount * np.maximum(length - self.slack, 0.0) * reach / np.maximum(length, 1e-9)
        torque = point_force_torque(ride.machine.model, q, ride.machine.n, np.zeros(3), force)
        return _between(ride, torque, every)


@dataclass(frozen=True, kw_only=True)
class SlippedBase(Effect):
    """A base that tilts at one time by `amount` [rad] about a horizontal axis."""

    moment: float = 0.0
    heading: float = 0.0

    name = "unexplained"
    largest = 0.2

    @classmethod
    def joints(cls, machine: Machine) -> tuple[int | None, ...]:
        return (None,)

    @classmethod
    def draw(cls, machine: Machine, rng: np.random.Generator, joint: int | None, span: float) -> SlippedBase:
        return cls(moment=span * rng.uniform(0.2, 0.8), heading=rng.uniform(0, 2 * np.pi))

    def torque(self, ride: Ride) -> np.ndarray:
        model, still = ride.machine.model, np.zeros_like(ride.q)
        turn = pin.exp3(self.amount * np.array([np.cos(self.heading), np.sin(self.heading), 0.0]))
        field = with_gravity(model, turn @ model.gravity.linear - model.gravity.linear)
        return (ride.t >= self.moment)[:, None] * rigid_torque(field, ride.link_q, still, still)

    def truths(self) -> dict[str, float]:
        return {"change_time": self.moment}


@dataclass(frozen=True, kw_only=True)
class Conveyor(Effect):
    """Another machine that pushes the flange with `amount` [N] once per cycle, bell-shaped in time."""

    period: float = 4.0
    phase: float = 0.0
    seconds: float = 0.06
    direction: tuple[float, float, float] = (1.0, 0.0, 0.0)

    name = "unexplained"
    largest = 3000.0

    @classmethod
    def joints(cls, machine: Machine) -> tuple[int | None, ...]:
        return (None,)

    @classmethod
    def draw(cls, machine: Machine, rng: np.random.Generator, joint: int | None, span: float) -> Conveyor:
        direction = rng.normal(size=3)
        return cls(
            period=log_uniform(rng, 2.0, 9.0),
            phase=rng.uniform(),
            seconds=log_uniform(rng, 0.04, 0.3),
            direction=tuple((direction / np.linalg.norm(direction)).tolist()),
        )

    def torque(self, ride: Ride) -> np.ndarray:
        since = (np.mod(ride.t / self.period - self.phase + 0.5, 1.0) - 0.5) * self.period
        force = self.amount * np.exp(-0.5 * (since / self.seconds) ** 2)[:, None] * np.array(self.direction)
        return point_force_torque(ride.machine.model, ride.link_q, ride.machine.n, np.zeros(3), force)

    def truths(self) -> dict[str, float]:
        return {"period": self.period}


def _places(machine: Machine, q: np.ndarray, point: np.ndarray) -> np.ndarray:
    data = machine.model.createData()
    places = np.empty((len(q), 3))
    for k in range(len(q)):
        pin.forwardKinematics(machine.model, data, q[k])
        places[k] = data.oMi[machine.n].act(point)
    return places


def _thinning(ride: Ride) -> int:
    """Returns the number of rows in 4 ms; torques that change with the pose are slow enough for such steps."""
    return max(round(0.004 / ride.step), 1)


def _between(ride: Ride, thinned: np.ndarray, every: int) -> np.ndarray:
    """Interpolates the values (N', n) of every `every`-th row to all rows (N, n)."""
    places = np.arange(len(ride.t)) / every
    return np.column_stack([np.interp(places, np.arange(len(thinned)), column) for column in thinned.T])

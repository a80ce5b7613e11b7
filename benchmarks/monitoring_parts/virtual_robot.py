"""A fast virtual robot for months of operation: rigid body by pinocchio, its own heat, damage, payload and contact.

It shares no code with the monitor or the thermal models. Friction falls exponentially with the temperature, and the
Coulomb part falls less than the viscous one; heat follows the real friction, and the ambient temperature varies over
the day. A thermal model fitted to it is thus only approximately right, as on a real robot.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from benchmarks.monitoring_parts.stops import held_torque, moves_with_stops
from oed.benchmarks.truth.dynamics import massless, point_force_torque, rigid_torque, with_tool
from oed.benchmarks.truth.machines import Machine, draw_machine
from oed.benchmarks.truth.noise import Noise, draw_noise
from oed.benchmarks.truth.references import Reference, draw_periodic
from robots.signals import Log

STEP = 0.004
PERIOD = 10.0
DAY = 86_400.0
# Time constants of gear and housing [s].
FAST, SLOW = 140.0, 1450.0


@dataclass(frozen=True, kw_only=True)
class Cause:
    """Something that happens.

    Attributes:
        kind: damage, payload or contact.
        time: when [s].
        joint: of a damage, from 1.
        amount: share of the friction, mass [kg], or force [N].
        centre: of a payload in the flange's frame [m].
        direction: of a force in the base frame.
        seconds: how long a force acts.
    """

    kind: str
    time: float
    joint: int = 0
    amount: float = 0.0
    centre: tuple[float, float, float] = (0.0, 0.0, 0.1)
    direction: tuple[float, float, float] = (1.0, 0.0, 0.0)
    seconds: float = 1.0


class VirtualRobot:
    """One robot that repeats motions of 10 s, or moves with stops.

    Args:
        seed: of robot, motion, noise and heat.
        fall: share of the friction that is lost at full duty in thermal equilibrium.
        swing: amplitude of the ambient temperature over the day [K].
        kind: of the robot.
    """

    def __init__(self, seed: int, *, fall: float = 0.4, swing: float = 3.0, kind: str = "er3a") -> None:
        self.rng = np.random.default_rng([seed, 55])
        self.machine: Machine = draw_machine(kind, self.rng)
        self.n = self.machine.n
        self.noise: Noise = draw_noise(self.n, self.machine.gear, self.rng)
        self.swing = swing
        self.times = np.array([FAST, SLOW])[:, None] * self.rng.uniform(0.8, 1.25, (2, self.n))
        self.parts = np.stack([share := self.rng.uniform(0.3, 0.6, self.n), 1 - share])
        self.coulomb_share = self.rng.uniform(0.6, 0.95, self.n)
        # exp(-alpha x) of the viscous friction, x = 1 at the temperature of full duty.
        self.alpha = -np.log(1 - fall) * self.rng.uniform(0.9, 1.1, self.n)
        self.kelvin = self.rng.uniform(25.0, 35.0)
        self.heat = np.zeros((2, self.n))
        self.clock = 0.0
        self.causes: list[Cause] = []
        self.motions: list[tuple[np.ndarray, ...]] = []
        self.add_motion()
        self.level = np.maximum(self._power(0, np.ones(self.n), np.ones(self.n)), 1e-9)

    def add_motion(self, reference: Reference | None = None) -> int:
        """Draws another motion, and returns its number."""
        reference = reference or draw_periodic(self.machine, self.rng, period=PERIOD, cycles=1)
        return self._added(*reference.at(np.arange(round(PERIOD / STEP)) * STEP))

    def add_moves(self, seconds: float) -> int:
        """Draws moves from point to point with stops, and returns the number of this motion."""
        m, t = self.machine, np.arange(round(seconds / STEP)) * STEP
        return self._added(*moves_with_stops(t, m.lower, m.upper, m.speed, self.rng))

    def _added(self, q: np.ndarray, v: np.ndarray, a: np.ndarray) -> int:
        m = self.machine
        rigid = rigid_torque(m.model, q, v, a) + m.rotor * a + m.offset
        self.motions.append((q, v, a, rigid, np.tanh(v / m.sign_width)))
        return len(self.motions) - 1

    def _friction(self, motion: int) -> tuple[np.ndarray, np.ndarray]:
        """Coulomb part and the rest (N, n) [N m], at ambient temperature."""
        _, v, _, _, sign = self.motions[motion]
        f = self.machine.friction
        return f[:, 0] * sign, f[:, 1] * v + f[:, 2] * v * np.abs(v) + f[:, 3] * v**3

    def _power(self, motion: int, coulomb: np.ndarray, viscous: np.ndarray) -> np.ndarray:
        c, w = self._friction(motion)
        v = self.motions[motion][1]
        return ((c * coulomb + w * viscous) * v).mean(axis=0)

    def ambient(self, t: float) -> float:
        """Deviation of the ambient temperature [K]."""
        return float(self.swing * np.sin(2 * np.pi * t / DAY))

    def factors(self, t: float) -> tuple[np.ndarray, np.ndarray]:
        """Coulomb and viscous friction (n,) over those at the reference temperature."""
        x = (self.parts * self.heat).sum(axis=0) + self.ambient(t) / self.kelvin
        damage = np.ones(self.n)
        for cause in self.causes:
            if cause.kind == "damage" and t >= cause.time:
                damage[cause.joint - 1] *= 1 + cause.amount
        return damage * np.exp(-self.alpha * self.coulomb_share * x), damage * np.exp(-self.alpha * x)

    def rest(self, seconds: float) -> None:
        """Lets the robot cool down."""
        self.heat = self.heat * np.exp(-seconds / self.times)
        self.clock += seconds

    def warm_up(self, seconds: float, motion: int = 0) -> None:
        """Moves without a log."""
        self._run(seconds, motion, record=False)

    def log(self, seconds: float, motion: int = 0, name: str = "") -> Log:
        """Moves for a time, and gives the log."""
        found = self._run(seconds, motion, record=True)
        assert found is not None
        t, q, tau = found
        return Log(t, q, tau, name=name)

    def _run(self, seconds: float, motion: int, *, record: bool) -> tuple[np.ndarray, ...] | None:
        # Heat in steps of 1 s: a hundredth of the fast time constant.
        count, rows = round(seconds), round(1.0 / STEP)
        q, v, _, rigid, _ = self.motions[motion]
        c, w = self._friction(motion)
        start = self.clock
        times, places, torques = [], [], []
        edges = [cause.time for cause in self.causes if start < cause.time < start + seconds]
        for k in range(count):
            fc, fv = self.factors(self.clock)
            index = (np.arange(rows) + k * rows) % len(q)
            power = ((c[index] * fc + w[index] * fv) * v[index]).mean(axis=0) / self.level
            if record:
                t = self.clock + np.arange(rows) * STEP
                tau = rigid[index] + c[index] * fc + w[index] * fv
                if any(self.clock < edge < self.clock + 1.0 for edge in edges):
                    after = self.factors(self.clock + 1.0)
                    late = (t >= min(e for e in edges if e > self.clock))[:, None]
                    tau = np.where(late, rigid[index] + c[index] * after[0] + w[index] * after[1], tau)
                times.append(t)
                places.append(index)
                torques.append(tau)
            self.heat = self.heat + (power - self.heat) * (1 - np.exp(-1.0 / self.times))
            self.clock += 1.0
        if not record:
            return None
        t, index, clean = np.concatenate(times), np.concatenate(places), np.concatenate(torques)
        if (v == 0.0).any():
            clean = clean + held_torque(v[index], self.machine.friction[:, 0] * self.factors(start)[0], self.rng)
        size = np.sqrt((rigid**2).mean(axis=0) + (c**2).mean(axis=0))
        clean = clean + self._extra(t, index, motion)
        return t, self.noise.position(q[index]), clean + self.noise.torque(len(t), size, self.rng)

    def _extra(self, t: np.ndarray, index: np.ndarray, motion: int) -> np.ndarray:
        q, v, a, _, _ = self.motions[motion]
        found = np.zeros((len(t), self.n))
        for cause in self.causes:
            if cause.kind == "payload" and t[-1] >= cause.time:
                tool = pin.Inertia.FromBox(cause.amount, 0.1, 0.1, 0.1)
                tool.lever = np.array(cause.centre)
                torque = rigid_torque(with_tool(massless(self.machine.model), tool), q, v, a)
                found += torque[index] * (t >= cause.time)[:, None]
            if cause.kind == "contact":
                s = (t - cause.time) / cause.seconds
                strength = np.where((s > 0) & (s < 1), np.sin(np.pi * np.clip(s, 0, 1)), 0.0)
                if strength.any():
                    force = cause.amount * strength[:, None] * np.array(cause.direction)
                    found += point_force_torque(self.machine.model, q[index], self.n, np.array([0.0, 0.0, 0.1]), force)
        return found

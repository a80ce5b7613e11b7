"""A virtual arm whose torque comes from pinocchio, and its exact model, for tests of the monitor."""

from __future__ import annotations

import dataclasses

import numpy as np
import pinocchio as pin

from estimation.models.model import Model
from oed.benchmarks.truth.description import write_description
from oed.benchmarks.truth.dynamics import massless, rigid_torque, with_tool
from oed.benchmarks.truth.machines import draw_machine
from oed.benchmarks.truth.references import draw_periodic
from robots import load_robot
from robots.regressor import default_model
from robots.signals import Log

PERIOD, STEP = 10.0, 0.008
NOISE = 0.02


class Arm:
    """An er3a that repeats a motion of 10 s; rows are made in no time.

    Attributes:
        model: its exact model, with made-up small errors.
        size: torque RMS (n,).
    """

    def __init__(self, place, seed=3):
        rng = np.random.default_rng(seed)
        machine = draw_machine("er3a", rng)
        friction = np.column_stack([machine.friction[:, :2], np.zeros((6, 2))])
        self.machine = dataclasses.replace(machine, known=machine.model, known_rotor=machine.rotor, friction=friction)
        self.robot = load_robot(str(write_description(self.machine, place)))
        t = np.arange(round(PERIOD / STEP)) * STEP
        self.t = t
        self.q, self.v, self.a = draw_periodic(machine, rng, period=PERIOD, cycles=1).at(t)
        rigid = rigid_torque(machine.model, self.q, self.v, self.a)
        self.rigid = rigid + machine.rotor * self.a + machine.offset
        self.friction = friction[:, 0] * np.sign(self.v) + friction[:, 1] * self.v
        self.size = np.sqrt(((self.rigid + self.friction) ** 2).mean(axis=0))
        self.model = self._model()

    def _model(self):
        torque_model = default_model(self.robot, friction="coulomb-viscous")
        values = []
        for column in torque_model.columns:
            j = column.joint - 1
            value = 0.0
            if column.symbol in ("f1", "f2"):
                value = self.machine.friction[j, int(column.symbol[1]) - 1]
            elif column.term == "torque_offset":
                value = self.machine.offset[j]
            elif column.term == "rotor_inertia":
                value = self.machine.rotor[j]
            else:
                value = np.asarray(self.robot.inertia)[j][
                    [c.name for c in torque_model.columns if c.joint == j + 1].index(column.name)
                ]
            values.append(value)
        count = torque_model.size
        return Model(
            torque_model=torque_model,
            columns=tuple(range(count)),
            values=np.array(values),
            covariance=1e-8 * np.eye(count),
            determined=np.ones(count, dtype=bool),
            formulas=torque_model.names,
            provenance={
                "cutoff_hz": 5.0,
                "residual_rms": (NOISE * self.size).tolist(),
                "torque_rms": self.size.tolist(),
                "recorded": {
                    "position": [self.q.min(0).tolist(), self.q.max(0).tolist()],
                    "velocity": [np.abs(self.v).max(0).tolist()],
                    "acceleration": [np.abs(self.a).max(0).tolist()],
                },
            },
        )

    def payload(self, mass, centre=(0.0, 0.0, 0.1)):
        """Torque (N, n) of one period with a point-like body on the flange, beyond that without it."""
        tool = pin.Inertia.FromBox(mass, 0.05, 0.05, 0.05)
        tool.lever = np.array(centre)
        return rigid_torque(with_tool(massless(self.machine.model), tool), self.q, self.v, self.a)

    def log(self, start, seconds=60.0, *, factor=None, extra=None, seed=0, name=""):
        """A log of some periods.

        Args:
            start: its first time [s].
            seconds: its length.
            factor: friction over the model's at times (N,): (N, n) or (n,).
            extra: further torque at times (N,) and places in the period (N,): (N, n).
            seed: of the noise.
            name: of the log.
        """
        rng = np.random.default_rng([seed, round(start)])
        count = round(seconds / STEP)
        t = start + np.arange(count) * STEP
        index = np.arange(count) % len(self.q)
        scale = np.ones(6) if factor is None else factor(t)
        tau = self.rigid[index] + self.friction[index] * scale
        if extra is not None:
            tau = tau + extra(t, index)
        return Log(t, self.q[index], tau + NOISE * self.size * rng.normal(size=tau.shape), name=name)

    def moves_with_stops(self, start, count, *, seed=0, name=""):
        """A log of moves of 1 s between random points, with rests of 1 s, in which friction holds any torque.

        Args:
            start: its first time [s].
            count: of the moves.
            seed: of the points, of what friction holds, and of the noise.
            name: of the log.
        """
        rng = np.random.default_rng([seed, round(start), 5])
        low, high = self.q.min(axis=0), self.q.max(axis=0)
        points = (low + high) / 2 + rng.uniform(-0.25, 0.25, (count + 1, 6)) * (high - low)
        x = np.arange(round(1.0 / STEP)) * STEP
        shapes = np.stack([
            10 * x**3 - 15 * x**4 + 6 * x**5, 30 * x**2 - 60 * x**3 + 30 * x**4, 60 * x - 180 * x**2 + 120 * x**3,
        ])  # fmt: skip
        ends = np.stack([np.ones(len(x)), np.zeros(len(x)), np.zeros(len(x))])
        shape = np.concatenate([shapes, ends], axis=1)
        change = np.diff(points, axis=0)
        q, v, a = (np.concatenate([part[:, None] * step for step in change]) for part in shape)
        q += np.repeat(points[:-1], shape.shape[1], axis=0)
        held = np.repeat(rng.uniform(-1.0, 1.0, (count, 6)), shape.shape[1], axis=0)
        m, own = self.machine, self.machine.friction
        friction = own[:, 0] * np.where(v == 0.0, held, np.sign(v)) + own[:, 1] * v
        tau = rigid_torque(m.model, q, v, a) + m.rotor * a + m.offset + friction
        t = start + np.arange(len(q)) * STEP
        return Log(t, q, tau + NOISE * self.size * rng.normal(size=tau.shape), name=name)


def write(log, file):
    """Writes a log as CSV, with its folder."""
    file.parent.mkdir(parents=True, exist_ok=True)
    names = ["t", *(f"q{j}" for j in range(1, 7)), *(f"tau{j}" for j in range(1, 7))]
    table = np.column_stack([log.t, log.q, log.tau])
    np.savetxt(file, table, delimiter=",", header=",".join(names), comments="", fmt="%.9g")

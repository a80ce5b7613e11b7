"""The closed loop of a robot and its drives as expressions: the balance of torques, and one step in time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, cached_property

import casadi
import numpy as np
from numpy.typing import NDArray

from robots.batch import BatchFunction, batch_function, builds_expressions
from robots.common.errors import InputError
from robots.drives.base import Instant
from robots.drives.drive import Drive
from robots.drives.dry_friction import dry_velocities
from robots.robot import MASSES_REMEDY, Robot
from robots.terms import RigidBody

Array = NDArray[np.float64]

PASSES = 2
"""Times that a step's smooth torques are evaluated again: each brings the velocity at its end h / T nearer, T the time
constant of the fastest loop."""


@dataclass(frozen=True, eq=False)
class Layout:
    """Which parameter is where: for each of the P parameters of a robot its joint, counted from 0, and its name."""

    joints: NDArray[np.intp]
    names: tuple[str, ...]

    @cached_property
    def _places(self) -> dict[tuple[int, str], int]:
        return {(int(j), name): k for k, (j, name) in enumerate(zip(self.joints, self.names, strict=True))}

    @cached_property
    def of_joints(self) -> tuple[NDArray[np.intp], ...]:
        """Per joint the indices of its own parameters: those that act on no other joint."""
        own = np.array([name != "mass_factor" for name in self.names])
        return tuple(np.flatnonzero((self.joints == j) & own) for j in range(int(self.joints.max()) + 1))

    @cache  # noqa: B019 - a layout lives as long as its dynamics.
    def of(self, name: str) -> NDArray[np.intp]:
        """Indices of a parameter on all joints that have it."""
        return np.array([k for k, own in enumerate(self.names) if own == name], dtype=np.intp)

    def place(self, joint: int, name: str) -> int:
        """Index of a joint's parameter."""
        return self._places[joint, name]


class DriveDynamics:
    """A serial chain whose joints are moved by drives.

    The integration is an implicit midpoint rule of second order. Dry friction holds a joint without small steps.

    Args:
        robot: a chain of n joints with known masses.
        drives: of its joints (n).
        width: speed [rad/s or m/s] below which dry friction fades.

    Raises:
        InputError: another number of drives, or a robot without masses.
    """

    def __init__(self, robot: Robot, drives: Sequence[Drive], width: float = 1e-4) -> None:
        if len(drives) != robot.n:
            raise InputError(f"{len(drives)} drives of {robot.name}", allowed=f"{robot.n}, one per joint")
        if not robot.has_masses:
            raise InputError(
                f"the masses of {robot.name} are not known",
                remedy=f"without torque all values are relative to them: {MASSES_REMEDY}",
            )
        self.robot, self.drives, self.width = robot, tuple(drives), width
        names = [(j, name) for j, drive in enumerate(drives) for name in drive.names]
        self.layout = Layout(np.array([j for j, _ in names], dtype=np.intp), tuple(name for _, name in names))
        self.owners = np.array([j for j, drive in enumerate(drives) for _ in drive.states], dtype=np.intp)

    @property
    def n(self) -> int:
        """Number of joints."""
        return self.robot.n

    @property
    def size(self) -> int:
        """Number of parameters P."""
        return len(self.layout.names)

    @property
    def values(self) -> Array:
        """The drives' parameters (P,)."""
        return np.array([drive.values[name] for drive in self.drives for name in drive.names])

    @cached_property
    def balance(self) -> casadi.Function:
        """(q, dq, ddq, command, state, p) -> torques of drives and rigid body, sizes of dry friction (n,), rates (s,).

        The drives' torque is that without dry friction.
        """
        n, s = self.n, len(self.owners)
        q, dq, ddq, command = (casadi.SX.sym(name, n) for name in ("q", "dq", "ddq", "command"))
        state, p = casadi.SX.sym("state", s), casadi.SX.sym("p", self.size)
        Y = RigidBody().regressor(self.robot, q, dq, ddq)
        factors = [p[self.layout.place(j, "mass_factor")] for j in range(n)]
        inertia = casadi.vertcat(*(factors[j] * casadi.DM(self.robot.inertia[j]) for j in range(n)))
        rigid = Y @ inertia
        torques, sizes, rates = [], [], []
        for j, drive in enumerate(self.drives):
            own = {name: p[self.layout.place(j, name)] for name in drive.names}
            states = dict(zip(drive.states, (state[int(k)] for k in np.flatnonzero(self.owners == j)), strict=True))
            measured = q[j] + own["encoder_zero"]
            now = Instant(self.robot, j, measured, dq[j], ddq[j], rigid[j], states)
            torque, dry, rate = drive.torque(command[j], now, own)
            torques.append(torque)
            sizes.append(dry)
            rates += rate
        outputs = [casadi.vertcat(*torques), rigid, casadi.vertcat(*sizes), casadi.vertcat(casadi.SX(0, 1), *rates)]
        return casadi.Function("balance", [q, dq, ddq, command, state, p], outputs)

    @cached_property
    def step(self) -> BatchFunction:
        """(state (3 n + s), [h, command] (n + 1), p) -> state after a step; it holds q, dq, ddq and drive states."""
        return batch_function(self._step())

    @cached_property
    def slopes(self) -> BatchFunction:
        """(q, dq, ddq, command, state, p) -> residual (n,), its Jacobian by [q, dq, ddq, command, state], by p; rates'.

        The residual includes dry friction. A parameter acts on its own joint alone, except the links' mass factors; so
        the derivatives by p are (1, P), and those by the n mass factors (n, n).
        """
        return batch_function(self._slopes())

    @builds_expressions
    def _step(self) -> casadi.Function:
        n, s = self.n, len(self.owners)
        state, inputs, p = casadi.SX.sym("x", 3 * n + s), casadi.SX.sym("u", n + 1), casadi.SX.sym("p", self.size)
        q, v, a, own = state[:n], state[n : 2 * n], state[2 * n : 3 * n], state[3 * n :]
        h, command = inputs[0], inputs[1:]
        z = casadi.SX.sym("z", n)
        middle, acceleration = q + h / 2 * z, 2 * (z - v) / h
        rate = self.balance(middle, z, acceleration, command, own, p)[3]
        torque, rigid, dry, _ = self.balance(middle, z, acceleration, command, own + h / 2 * rate, p)
        predicted = v + h / 2 * a
        # The mass matrix couples the joints; all other slopes are the joint's own.
        y = casadi.SX.sym("y", n)
        mass = casadi.jacobian(self.balance(q + h / 2 * predicted, predicted, y, command, own, p)[1], y)
        slopes = casadi.vertcat(*(casadi.jacobian(torque[j], z[j]) for j in range(n)))
        evaluate = casadi.Function("evaluate", [z, state, inputs, p], [torque - rigid, dry, slopes])
        velocity = predicted
        for index in range(PASSES):
            left, size, slope = evaluate(velocity, state, inputs, p)
            matrix = 2 / h * mass + casadi.diag(casadi.fmax(-slope, 0))
            right = left + matrix @ velocity
            velocity = dry_velocities(matrix, right, size, velocity, self.width, last=index == PASSES - 1)
        final = self.balance(q + h / 2 * velocity, velocity, 2 * (velocity - v) / h, command, own, p)[3]
        new = casadi.vertcat(q + h * velocity, 2 * velocity - v, 2 * (velocity - v) / h, own + h * final)
        return casadi.Function("step", [state, inputs, p], [new])

    @builds_expressions
    def _slopes(self) -> casadi.Function:
        n, s = self.n, len(self.owners)
        names = ("q", "dq", "ddq", "command")
        inputs = [*(casadi.SX.sym(name, n) for name in names), casadi.SX.sym("s", s), casadi.SX.sym("p", self.size)]
        torque, rigid, dry, rates = self.balance(*inputs)
        residual = torque - rigid - dry * casadi.tanh(inputs[1] / self.width)
        moving, by_p = casadi.vertcat(*inputs[:5]), casadi.jacobian(residual, inputs[5])
        outputs = [
            residual,
            casadi.jacobian(residual, moving),
            casadi.sum1(by_p),
            by_p[:, self.layout.of("mass_factor").tolist()],
        ]
        if s:
            outputs += [casadi.jacobian(rates, moving), casadi.jacobian(casadi.sum1(rates), inputs[5])]
        return casadi.Function("slopes", inputs, [casadi.densify(out) for out in outputs])

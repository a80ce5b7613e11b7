"""The closed loop of a robot and its drives as expressions: the balance of torques, and one step in time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, cached_property

import casadi
import numpy as np
from numpy.typing import NDArray

from robots.batch import BatchFunction, batch_function, builds_expressions
from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.drives.base import Instant
from robots.drives.drive import Drive
from robots.drives.dry_friction import dry_velocities
from robots.robot import MASSES_REMEDY, Robot
from robots.terms import RigidBody

PASSES = 2
"""Times that a step's smooth torques are evaluated again: each brings the velocity at its end h / T nearer, T the time
constant of the fastest loop."""
BODY, BASE = 10, 9
"""Numbers of a body's inertial parameters, and of the motion of a base, see `RigidBody.moving`."""
MORE = 3
"""Further passes with elastic gears, whose flanks may be reached within a step."""


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
        situated: whether base and payload of a run are inputs: a base that moves or stands otherwise than described,
            and a known body on the last link.

    Raises:
        InputError: another number of drives, or a robot without masses.
    """

    def __init__(self, robot: Robot, drives: Sequence[Drive], *, situated: bool = False) -> None:
        if len(drives) != robot.n:
            raise InputError(f"{len(drives)} drives of {robot.name}", allowed=f"{robot.n}, one per joint")
        if not robot.has_masses:
            raise InputError(
                f"the masses of {robot.name} are not known",
                remedy=f"without torque all values are relative to them: {MASSES_REMEDY}",
            )
        self.robot, self.drives, self.situated = robot, tuple(drives), situated
        names = [(j, name) for j, drive in enumerate(drives) for name in drive.names]
        self.layout = Layout(np.array([j for j, _ in names], dtype=np.intp), tuple(name for _, name in names))
        self.owners = np.array([j for j, drive in enumerate(drives) for _ in drive.states], dtype=np.intp)
        self.parted = tuple(j for j, drive in enumerate(drives) if drive.gear is not None)

    @property
    def n(self) -> int:
        """Number of joints."""
        return self.robot.n

    @property
    def masses(self) -> int:
        """Number d of coordinates: those of the n motors, then those of the links behind elastic gears.

        Without an elastic gear a motor's coordinate is that of its joint.
        """
        return self.n + len(self.parted)

    @cached_property
    def links(self) -> NDArray[np.intp]:
        """Coordinates of the links (n,)."""
        found = np.arange(self.n)
        found[list(self.parted)] = self.n + np.arange(len(self.parted))
        return found

    @cached_property
    def shown(self) -> NDArray[np.intp]:
        """Coordinates that the encoders show (n,)."""
        return np.where([drive.encoder == "link" for drive in self.drives], self.links, np.arange(self.n))

    @property
    def size(self) -> int:
        """Number of parameters P."""
        return len(self.layout.names)

    @property
    def extra(self) -> tuple[int, int]:
        """Numbers that follow the parameters and the commands.

        After the parameters a body, and the speed [rad/s or m/s] below which dry friction fades; after the commands the
        motion of the base.
        """
        return (BODY + 1, BASE) if self.situated else (1, 0)

    @property
    def values(self) -> Array:
        """The drives' parameters (P,)."""
        return np.array([drive.values[name] for drive in self.drives for name in drive.names])

    @cached_property
    def balance(self) -> casadi.Function:
        """(x, dx, ddx, command, state, p, base) -> torques (d,), rigid body (n,), dry friction (n,), rates, efforts.

        The torques are those of drives on motors and links, without dry friction. The rigid body takes its part from
        the links. The efforts are the motors' torques (n,).
        """
        n, d, s = self.n, self.masses, len(self.owners)
        x, dx, ddx = (casadi.SX.sym(name, d) for name in ("x", "dx", "ddx"))
        command, state = casadi.SX.sym("command", n), casadi.SX.sym("state", s)
        p, base = casadi.SX.sym("p", self.size + self.extra[0]), casadi.SX.sym("base", self.extra[1])
        places = self.links.tolist()
        factors = [p[self.layout.place(j, "mass_factor")] for j in range(n)]
        inertia = casadi.vertcat(*(factors[j] * casadi.DM(self.robot.inertia[j]) for j in range(n)))
        if self.situated:
            inertia[-BODY:] += p[self.size : -1]
        signals = x[places], dx[places], ddx[places]
        rigid = RigidBody().moving(self.robot, *signals, base if self.situated else None) @ inertia
        torques, sizes, rates, efforts = casadi.SX(d, 1), [], [], []
        for j, drive in enumerate(self.drives):
            own = {name: p[self.layout.place(j, name)] for name in drive.names}
            states = dict(zip(drive.states, (state[int(k)] for k in np.flatnonzero(self.owners == j)), strict=True))
            encoder, link = int(self.shown[j]), int(self.links[j])
            zero, twist = own["encoder_zero"], (x[j] - x[link], dx[j] - dx[link])
            motor_now = Instant(self.robot, j, x[encoder] + zero, dx[encoder], dx[j], ddx[j], rigid[j], states, *twist)
            link_now = motor_now._replace(measured=x[link] + zero, dq=dx[link], ddq=ddx[link])
            found, dry, rate, effort = drive.torques(command[j], motor_now, link_now, own)
            torques[j] = found[0]
            if link != j:
                torques[link] = found[1]
            sizes.append(dry)
            efforts.append(effort)
            rates += rate
        outputs = [torques, rigid, casadi.vertcat(*sizes), casadi.vertcat(casadi.SX(0, 1), *rates)]
        return casadi.Function("balance", [x, dx, ddx, command, state, p, base], [*outputs, casadi.vertcat(*efforts)])

    @cached_property
    @builds_expressions
    def twist(self) -> casadi.Function:
        """(q, p, base) -> twist of the elastic gears (m,) at rest, and its derivatives by q (m, n) and p (m, P)."""
        q, rest = casadi.SX.sym("q", self.n), casadi.SX(self.masses, 1)
        p, base = casadi.SX.sym("p", self.size + self.extra[0]), casadi.SX.sym("base", self.extra[1])
        still = casadi.SX(self.n, 1), casadi.SX(len(self.owners), 1)
        full = casadi.SX(self.masses, 1)
        for j, place in enumerate(self.links.tolist()):
            full[j] = full[place] = q[j]
        rigid = self.balance(full, rest, rest, *still, p, base)[1]
        found = []
        for j in self.parted:
            gear = self.drives[j].gear
            assert gear is not None
            own = {name: p[self.layout.place(j, name)] for name in self.drives[j].names}
            found.append(gear.twist(rigid[j], own))
        twist = casadi.vertcat(casadi.SX(0, 1), *found)
        slopes = casadi.jacobian(twist, q), casadi.jacobian(twist, p)[:, : self.size]
        return casadi.Function("twist", [q, p, base], [twist, *slopes])

    @cached_property
    def step(self) -> BatchFunction:
        """(state (3 d + s), [h, command, base] (n + 1, or n + 10), p) -> state after a step.

        A state holds x, dx, ddx and the drives' own states.
        """
        return batch_function(self._step())

    @cached_property
    def slopes(self) -> BatchFunction:
        """(x, dx, ddx, command, state, p, base) -> residual (d,), its derivatives by signals and by p; those of rates.

        Signals are [x, dx, ddx, command, state]. The residual includes dry friction. A parameter acts on its own joint
        alone, except the links' mass factors; so the derivatives by p are (1, P), those of motors, or (2, P), those of
        motors and of links behind elastic gears. Those by the n mass factors are (d, n).
        """
        return batch_function(self._slopes())

    @cached_property
    def efforts(self) -> BatchFunction:
        """(x, dx, ddx, command, state, p, base) -> motors' torques (n,), derivatives as those of `slopes`: (1, P)."""
        return batch_function(self._efforts())

    @builds_expressions
    def _step(self) -> casadi.Function:
        n, d, s = self.n, self.masses, len(self.owners)
        state, inputs = casadi.SX.sym("x", 3 * d + s), casadi.SX.sym("u", 1 + n + self.extra[1])
        p = casadi.SX.sym("p", self.size + self.extra[0])
        x, v, a, own = state[:d], state[d : 2 * d], state[2 * d : 3 * d], state[3 * d :]
        h, command, base = inputs[0], inputs[1 : n + 1], inputs[n + 1 :]
        z = casadi.SX.sym("z", d)
        middle, acceleration = x + h / 2 * z, 2 * (z - v) / h
        rate = self.balance(middle, z, acceleration, command, own, p, base)[3]
        torque, rigid, dry, *_ = self.balance(middle, z, acceleration, command, own + h / 2 * rate, p, base)
        predicted = v + h / 2 * a
        # The mass matrix couples the joints; all other slopes are the joint's own, or of its motor and its link.
        y, places = casadi.SX.sym("y", d), self.links.tolist()
        mass = casadi.jacobian(self.balance(x + h / 2 * predicted, predicted, y, command, own, p, base)[1], y)
        slopes = casadi.SX(d, d)
        for j, place in enumerate(places):
            pair = sorted({j, place})
            slopes[pair, pair] = casadi.jacobian(torque[pair], z)[:, pair]
        left = torque - self._on_links(rigid)
        evaluate = casadi.Function("evaluate", [z, state, inputs, p], [left, dry, slopes])
        heavy = casadi.SX(d, d)
        heavy[places, :] = 2 / h * mass
        velocity = predicted
        passes = PASSES + (MORE if self.parted else 0)
        for index in range(passes):
            left, size, slope = evaluate(velocity, state, inputs, p)
            for k in range(d):
                slope[k, k] = casadi.fmin(slope[k, k], 0)
            velocity = self._solved(heavy - slope, left, size, velocity, p[-1], last=index == passes - 1)
        final = self.balance(x + h / 2 * velocity, velocity, 2 * (velocity - v) / h, command, own, p, base)[3]
        new = casadi.vertcat(x + h * velocity, 2 * velocity - v, 2 * (velocity - v) / h, own + h * final)
        return casadi.Function("step", [state, inputs, p], [new])

    def _on_links(self, torque: casadi.SX) -> casadi.SX:
        """Torques of the joints (n,) on the coordinates of their links (d,)."""
        found = casadi.SX(self.masses, 1)
        found[self.links.tolist()] = torque
        return found

    def _solved(
        self,
        matrix: casadi.SX,
        left: casadi.SX,
        dry: casadi.SX,
        velocity: casadi.SX,
        width: casadi.SX,
        *,
        last: bool,
    ) -> casadi.SX:
        """Solves matrix (z - velocity) + dry friction of the motors = left for the velocities z (d,).

        Links behind elastic gears have no dry friction, and are eliminated.
        """
        n, right = self.n, left + matrix @ velocity
        if not self.parted:
            return dry_velocities(matrix, right, dry, velocity, width, last=last)
        inner, down, across = matrix[n:, n:], matrix[n:, :n], matrix[:n, n:]
        solved = casadi.solve(inner, casadi.horzcat(down, right[n:]))
        reduced, rest = matrix[:n, :n] - across @ solved[:, :n], right[:n] - across @ solved[:, n]
        motors = dry_velocities(reduced, rest, dry, velocity[:n], width, last=last)
        return casadi.vertcat(motors, solved[:, n] - solved[:, :n] @ motors)

    @builds_expressions
    def _slopes(self) -> casadi.Function:
        n, s = self.n, len(self.owners)
        inputs = self._signals()
        torque, rigid, dry, rates, _ = self.balance(*inputs)
        residual = torque - self._on_links(rigid)
        residual[:n] -= dry * casadi.tanh(inputs[1][:n] / inputs[5][-1])
        moving, by_p = casadi.vertcat(*inputs[:5]), casadi.jacobian(residual, inputs[5])[:, : self.size]
        sums = [casadi.sum1(by_p[:n, :]), *([casadi.sum1(by_p[n:, :])] if self.parted else [])]
        outputs = [
            residual,
            casadi.jacobian(residual, moving),
            casadi.vertcat(*sums),
            by_p[:, self.layout.of("mass_factor").tolist()],
        ]
        if s:
            outputs += [casadi.jacobian(rates, moving), casadi.jacobian(casadi.sum1(rates), inputs[5])[:, : self.size]]
        return casadi.Function("slopes", inputs, [casadi.densify(out) for out in outputs])

    @builds_expressions
    def _efforts(self) -> casadi.Function:
        inputs = self._signals()
        effort = self.balance(*inputs)[4]
        by_p = casadi.sum1(casadi.jacobian(effort, inputs[5])[:, : self.size])
        outputs = [effort, casadi.jacobian(effort, casadi.vertcat(*inputs[:5])), by_p]
        return casadi.Function("efforts", inputs, [casadi.densify(out) for out in outputs])

    def _signals(self) -> list[casadi.SX]:
        d, names = self.masses, ("x", "dx", "ddx", "command", "s", "p", "base")
        body, base = self.extra
        sizes = (d, d, d, self.n, len(self.owners), self.size + body, base)
        return [casadi.SX.sym(name, size) for name, size in zip(names, sizes, strict=True)]

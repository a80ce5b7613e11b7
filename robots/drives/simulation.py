"""Simulation of a robot in the closed loop of its drives, with exact sensitivities to the drives' parameters."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from robots.common.arrays import Array
from robots.common.errors import SolverError
from robots.drives.delay import HeldCommand
from robots.drives.dynamics import BODY, DriveDynamics
from robots.robot import Robot

UNSTABLE = 1e3
"""Positions [rad or m] beyond which a loop counts as unstable."""

LONGEST = 2.5e-3
"""Longest step [s] by default: at a time constant of 10 ms its error is below a per cent of the motion's lag."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Situation:
    """What a run has around the drives.

    Attributes:
        t: times (N,) [s].
        base: motion of the base (N, 9), see `RigidBody.moving`.
        body: inertial parameters of a known payload in the frame of the last link (10,).
    """

    t: Array
    base: Array
    body: Array

    def at(self, times: Array) -> Array:
        """The motion of the base at other times (K,)."""
        return np.column_stack([np.interp(times, self.t, column) for column in self.base.T])

    @staticmethod
    def usual(robot: Robot) -> Situation:
        """A base at rest as described, without a payload."""
        still = np.concatenate([-np.asarray(robot.chain.gravity, dtype=float), np.zeros(6)])
        return Situation(t=np.zeros(1), base=still[None], body=np.zeros(BODY))


class Start(NamedTuple):
    """State of the n joints at the beginning: positions by the encoders [rad or m] and velocities [rad/s or m/s]."""

    measured: Array
    dq: Array


@dataclass(frozen=True, kw_only=True, eq=False)
class Simulated:
    """A simulated run.

    Attributes:
        t: times of the samples (N,) [s].
        measured: positions as the encoders show them (N, n) [rad or m].
        dq: velocities (N, n) [rad/s or m/s].
        sensitivity: derivatives of `measured` by the chosen combinations of parameters (N, n, k), if they were asked
            for.
        effort: torques of the motors (N, n) [N m or N], if they were asked for.
        effort_sensitivity: their derivatives (N, n, k).
        residual: largest residual of the balance of torques in all steps (d,) [N m or N], if they were.
    """

    t: Array
    measured: Array
    dq: Array
    sensitivity: Array | None = None
    effort: Array | None = None
    effort_sensitivity: Array | None = None
    residual: Array | None = None


WIDTH = 1e-4
"""Speed [rad/s or m/s] below which dry friction fades by default: small beside a motion's, but a motion that sticks and
slips still changes smoothly with the parameters."""


class Steps(NamedTuple):
    """Times of a simulation: edges of the steps (K + 1,) [s], and the steps of a sample."""

    edges: Array
    substeps: int


def usual_step(t: Array) -> float:
    """Gives the step [s] for samples at these times (N,): a log of a high rate is to show fast parts of the motion."""
    return min(LONGEST, 0.5 * float(np.median(np.diff(t))))


def step_times(t: Array, longest: float) -> Steps:
    """Divides the time between samples (N,) [s] into equal steps of at most `longest` [s]."""
    substeps = max(1, int(np.ceil(float(np.median(np.diff(t))) / longest - 1e-6)))
    share = np.arange(substeps) / substeps
    edges = (t[:-1, None] + np.diff(t)[:, None] * share).reshape(-1)
    return Steps(np.append(edges, t[-1]), substeps)


def simulate_drives(
    dynamics: DriveDynamics,
    command: HeldCommand,
    t: Array,
    start: Start,
    values: Array,
    *,
    directions: Array | None = None,
    longest: float | None = None,
    situation: Situation | None = None,
    efforts: bool = False,
    width: float = WIDTH,
) -> Simulated:
    """Simulates a chain that follows commands.

    Args:
        dynamics: the chain and its drives.
        command: what was commanded; it covers the times.
        t: times of the samples (N,) [s].
        start: state at the first one.
        values: parameters (P,).
        directions: combinations of parameters (P, k) by which derivatives are wanted; None for none.
        longest: longest step [s]; by default half the log's period, and at most `LONGEST`.
        situation: of a situated chain: its base and payload; by default as described.
        efforts: whether the torques of the motors are wanted.
        width: speed [rad/s or m/s] below which dry friction fades.

    Raises:
        SolverError: the loop is not stable.
    """
    layout, d, shown = dynamics.layout, dynamics.masses, dynamics.shown
    edges, substeps = step_times(t, usual_step(t) if longest is None else longest)
    zero, delay = layout.of("encoder_zero"), layout.of("delay")
    delays = np.zeros(dynamics.n)
    delays[layout.joints[delay]] = values[delay]
    means, slopes = command.means(edges, delays)
    h, around = np.diff(edges), (situation or Situation.usual(dynamics.robot)) if dynamics.situated else None
    p = followed(values, around, width)
    base = np.zeros((len(h), 0)) if around is None else around.at((edges[:-1] + edges[1:]) / 2)
    place, place_slopes = _placed(dynamics, start.measured - values[zero], p, base[0])
    speed = np.concatenate([start.dq, start.dq[list(dynamics.parted)]])
    first = np.concatenate([place, speed, np.zeros(d + len(dynamics.owners))])
    inputs = np.concatenate([h[:, None], means, base], axis=1)[:, None, :]
    states = dynamics.step.run(first[None], inputs, p[None])[:, 0]
    path = np.concatenate([first[None], states])
    if not np.isfinite(path).all() or np.abs(path[:, :d]).max() > UNSTABLE:
        raise SolverError(
            f"the simulated loop of {dynamics.robot.name} is not stable",
            remedy="check gains and delay, or start nearer to the truth",
        )
    result = Simulated(t=t, measured=path[::substeps, shown] + values[zero], dq=path[::substeps, d + shown])
    if directions is None and not efforts:
        return result
    middle = _middles(dynamics, path, h, means, p, base)
    if directions is None:
        effort = dynamics.efforts(*middle)[0][:, :, 0]
        return replace(result, effort=_at_samples(effort, substeps))
    moved = np.zeros((len(h), dynamics.n, directions.shape[1]))
    delay = layout.of("delay")
    moved[:, layout.joints[delay]] = slopes[:, layout.joints[delay], None] * directions[delay]
    sensitivity, residual = _sensitivity(dynamics, middle, h, moved, directions, place_slopes @ directions)
    chosen = sensitivity[::substeps, shown] + directions[zero]
    result = replace(result, sensitivity=chosen, residual=residual)
    if not efforts:
        return result
    effort, by_x, by_p = dynamics.efforts(*middle)
    between = (sensitivity[1:, :d] + sensitivity[:-1, :d]) / 2
    rates = (sensitivity[1:, :d] - sensitivity[:-1, :d]) / h[:, None, None]
    own = (sensitivity[1:, 2 * d :] + sensitivity[:-1, 2 * d :]) / 2
    by_q, by_v, _, by_command, by_state = np.split(by_x, np.cumsum([d, d, d, dynamics.n]), axis=2)
    total = by_q @ between + by_v @ rates + by_command @ moved + by_state @ own
    for joint in range(dynamics.n):
        mine = layout.of_joints[joint]
        total[:, joint] += by_p[:, 0, mine] @ directions[mine]
    found = (_at_samples(part, substeps) for part in (effort[:, :, 0], total))
    return replace(result, **dict(zip(("effort", "effort_sensitivity"), found, strict=True)))


def followed(values: Array, situation: Situation | None, width: float = WIDTH) -> Array:
    """Puts behind the parameters (P,) what `DriveDynamics.extra` says."""
    return np.concatenate([values, [] if situation is None else situation.body, [width]])


def _at_samples(values: Array, substeps: int) -> Array:
    """Values (N, ...) at samples, from those in the middle of K steps: the mean of the two steps that meet there."""
    padded = np.concatenate([values[:1], values, values[-1:]])
    return np.asarray((padded[:-1] + padded[1:])[::substeps] / 2)


def _middles(dynamics: DriveDynamics, path: Array, h: Array, means: Array, p: Array, base: Array) -> tuple[Array, ...]:
    """Signals in the middle of each step, as `DriveDynamics.slopes` takes them."""
    d = dynamics.masses
    q, v, own = path[:-1, :d], path[:-1, d : 2 * d], path[:-1, 3 * d :]
    velocity = (path[1:, :d] - q) / h[:, None]
    middle, acceleration = q + h[:, None] / 2 * velocity, 2 * (velocity - v) / h[:, None]
    half = (path[1:, 3 * d :] + own) / 2
    return middle, velocity, acceleration, means, half, np.broadcast_to(p, (len(h), len(p))), base


def _placed(dynamics: DriveDynamics, q: Array, p: Array, base: Array) -> tuple[Array, Array]:
    """Coordinates (d,) at rest where the encoders show q (n,), and their derivatives by the parameters (d, P)."""
    n, parted = dynamics.n, list(dynamics.parted)
    slopes = np.zeros((dynamics.masses, dynamics.size))
    slopes[dynamics.shown, dynamics.layout.of("encoder_zero")] = -1.0
    place = np.concatenate([q, q[parted]])
    if not parted:
        return place, slopes
    twist, by_q, by_p = (np.asarray(part, dtype=float) for part in dynamics.twist(q, p, base))
    for k, joint in enumerate(parted):
        by_link = dynamics.shown[joint] != joint
        other, sign = (joint, 1.0) if by_link else (n + k, -1.0)
        place[other] += sign * twist[k, 0]
        moved = slopes[dynamics.shown]
        slopes[other] = slopes[dynamics.shown[joint]] + sign * (by_p[k] + by_q[k] @ moved)
    return place, slopes


def _sensitivity(
    dynamics: DriveDynamics,
    middle: tuple[Array, ...],
    h: Array,
    moved: Array,
    directions: Array,
    start: Array,
) -> tuple[Array, Array]:
    """Derivatives of states by the implicit function theorem in each step; largest residuals (d,).

    Args:
        dynamics: the chain.
        middle: see `_middles`.
        h: lengths of the steps (K,) [s].
        moved: derivatives of the commands (K, n, k).
        directions: of the parameters (P, k).
        start: derivatives of the coordinates at the start (d, k).

    Returns:
        Those of coordinates, velocities and drive states (K + 1, 2 d + s, k), and the residuals.
    """
    n, d, s, layout = dynamics.n, dynamics.masses, len(dynamics.owners), dynamics.layout
    length = h[:, None, None]
    residual, J, by_own, by_mass, *of_rates = dynamics.slopes(*middle)
    ends = np.cumsum([d, d, d, n])
    Jq, Jv, Ja, Jc, Jx = np.split(J, ends, axis=2)
    # Columns by the directions: those of a joint's own parameters, of its command by the delay, and of masses.
    by_p = np.zeros((len(h), d, directions.shape[1]))
    mass = layout.of("mass_factor")
    for joint in range(n):
        mine = layout.of_joints[joint]
        by_p[:, joint] = by_own[:, 0, mine] @ directions[mine]
    for k, joint in enumerate(dynamics.parted):
        mine = layout.of_joints[joint]
        by_p[:, n + k] = by_own[:, 1, mine] @ directions[mine]
    if directions[mass].any():
        by_p += by_mass @ directions[mass]
    by_p += Jc @ moved
    size = 2 * d + s
    A, B = np.zeros((len(h), size, size)), np.zeros((len(h), size, directions.shape[1]))
    by_z, by_q, by_v = Jq * length / 2 + Jv + 2 / length * Ja, Jq, -2 / length * Ja
    if s:
        Rq, Rv, _, Rc, Rx = np.split(of_rates[0], ends, axis=2)
        Rp = _rate_columns(dynamics, of_rates[1], directions) + Rc @ moved
        # The state in the middle of a step: half = own + h / 2 rate(half), to be solved for its change.
        solved = np.linalg.inv(np.eye(s) - length / 2 * Rx)
        to_z, to_q, to_p = (solved @ (length / 2 * part) for part in (Rq * length / 2 + Rv, Rq, Rp))
        by_z, by_q, by_p = by_z + Jx @ to_z, by_q + Jx @ to_q, by_p + Jx @ to_p
        by_x = Jx @ solved
    inverse = -np.linalg.inv(by_z)
    zq, zv, zp = inverse @ by_q, inverse @ by_v, inverse @ by_p
    eye = np.eye(d)
    A[:, :d, :d], A[:, :d, d : 2 * d], B[:, :d] = eye + length * zq, length * zv, length * zp
    A[:, d : 2 * d, :d], A[:, d : 2 * d, d : 2 * d], B[:, d : 2 * d] = 2 * zq, 2 * zv - eye, 2 * zp
    if s:
        zx = inverse @ by_x
        A[:, :d, 2 * d :], A[:, d : 2 * d, 2 * d :] = length * zx, 2 * zx
        A[:, 2 * d :, :d] = 2 * (to_z @ zq + to_q)
        A[:, 2 * d :, d : 2 * d] = 2 * to_z @ zv
        A[:, 2 * d :, 2 * d :] = 2 * (to_z @ zx + solved) - np.eye(s)
        B[:, 2 * d :] = 2 * (to_z @ zp + to_p)
    first = np.zeros((size, directions.shape[1]))
    first[:d] = start
    return _recursion(A, B, first), np.abs(residual[:, :, 0]).max(axis=0)


def _rate_columns(dynamics: DriveDynamics, by_p: Array, directions: Array) -> Array:
    """Derivatives of the rates (K, s, k) by the directions; each state belongs to one joint."""
    found = np.zeros((len(by_p), len(dynamics.owners), directions.shape[1]))
    for k, joint in enumerate(dynamics.owners):
        mine = np.flatnonzero(dynamics.layout.joints == joint)
        found[:, k] = by_p[:, 0, mine] @ directions[mine]
    return found


def _recursion(A: Array, B: Array, first: Array) -> Array:
    """S_(k+1) = A_k S_k + B_k from a first S: all of them (K + 1, size, columns)."""
    S = np.empty((len(A) + 1, *first.shape))
    S[0] = first
    for k in range(len(A)):
        np.dot(A[k], S[k], out=S[k + 1])
        S[k + 1] += B[k]
    return S

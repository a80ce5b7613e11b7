"""Simulation of robots under position control, with any effects, which gives logs of t, q and tau."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from oed.benchmarks.truth.dynamics import Projection, base_regressor, rigid_torque
from oed.benchmarks.truth.effects.base import Effect
from oed.benchmarks.truth.machines import Machine
from oed.benchmarks.truth.noise import Noise
from oed.benchmarks.truth.references import Reference
from oed.benchmarks.truth.ride import Ride, friction_of

CONTROL_STEP = 0.001  # [s]
LOG_EVERY = 4  # control steps per logged sample
LOG_PAUSE = 20.0  # default pause between logs [s]


@dataclass(frozen=True, kw_only=True)
class Record:
    """One log (``t, q, tau``), and true signals that a user does not have.

    ``clean`` is the torque without noise, and ``parts`` are the effects' contributions to it. ``q_true, v_true,
    a_true`` are the logged positions without quantisation and their derivatives. ``sign`` is the smooth velocity sign.
    """

    t: np.ndarray
    q: np.ndarray
    tau: np.ndarray
    clean: np.ndarray
    parts: tuple[np.ndarray, ...]
    q_true: np.ndarray
    v_true: np.ndarray
    a_true: np.ndarray
    sign: np.ndarray


def play(
    machine: Machine,
    references: Sequence[Reference],
    effects: Sequence[Effect],
    noise: Noise,
    rng: np.random.Generator,
    *,
    pause: float | Sequence[float] = LOG_PAUSE,
) -> list[Record]:
    """Simulates references one after the other on one clock, with pauses [s] at rest between them."""
    pauses = np.broadcast_to(np.asarray(pause, dtype=float), (len(references) - 1,))
    durations = [reference.duration for reference in references]
    clocks = np.concatenate([[0.0], np.cumsum(durations[:-1] + pauses)]).tolist()
    ride = _closed_loop(machine, references, clocks, effects)
    clean, errors = measure(ride, effects)
    size = np.sqrt((clean[ride.runs[0]] ** 2).mean(axis=0))
    records = []
    for run in ride.runs:
        rows = slice(run.start, run.stop, LOG_EVERY)
        torque = clean[rows] + noise.torque(len(clean[rows]), size, rng)
        for effect in effects:
            torque = effect.last(torque)
        motion = [values[rows] + error[rows] for values, error in zip((ride.q, ride.v, ride.a), errors, strict=True)]
        records.append(
            Record(
                t=ride.t[rows],
                q=noise.position(motion[0]),
                tau=torque,
                clean=clean[rows],
                parts=tuple(part[rows] for part in ride.parts),
                q_true=motion[0],
                v_true=motion[1],
                a_true=motion[2],
                sign=np.tanh(motion[1] / machine.sign_width),
            )
        )
    return records


def measure(ride: Ride, effects: Sequence[Effect]) -> tuple[np.ndarray, tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Computes the logged torque without noise (N, n), and the error of the logged motion.

    It also fills ``ride.parts``. An effect's part is its contribution to the logged torque beyond the base model's
    torque for the logged motion.
    """
    machine, ride.parts, ride.carried = ride.machine, [], _carried(ride, effects)
    shares, apart = [], np.zeros_like(ride.q)
    for effect in effects:
        before = apart
        if parts_links(effect):
            effect.part(ride)
            ride.rigid = rigid_torque(machine.model, ride.q, ride.v, ride.a)
            apart = rigid_torque(machine.model, ride.link_q, ride.link_v, ride.link_a) - ride.rigid
        shares.append(apart - before)
    torque = ride.base_torque()
    for effect, share in zip(effects, shares, strict=True):
        own = effect.torque(ride)
        ride.parts.append(share if own is None else share + own)
        torque = torque + ride.parts[-1]
    errors = (np.zeros_like(ride.q), np.zeros_like(ride.q), np.zeros_like(ride.q))
    for index, effect in enumerate(effects):
        logged = effect.signal(ride, torque)
        ride.parts[index] = ride.parts[index] + logged - torque
        torque = logged
        wrong = effect.position(ride)
        if wrong is not None:
            errors = (errors[0] + wrong[0], errors[1] + wrong[1], errors[2] + wrong[2])
            q, v, a = (ride.q + wrong[0], ride.v + wrong[1], ride.a + wrong[2])
            seen = rigid_torque(machine.model, q, v, a) + machine.rotor * a
            seen += friction_of(machine.friction, v, np.tanh(v / machine.sign_width)) + machine.offset
            ride.parts[index] = ride.parts[index] + ride.base_torque() - seen
    return torque, errors


def _carried(ride: Ride, effects: Sequence[Effect]) -> np.ndarray | None:
    loads = [load for effect in effects if (load := effect.load(ride)) is not None]
    return np.sum(loads, axis=0) if loads else None


def parts_links(effect: Effect) -> bool:
    """Returns whether an effect moves links relative to their motors."""
    return type(effect).part is not Effect.part


def open_loop(
    machine: Machine,
    references: Sequence[Reference],
    effects: Sequence[Effect],
    *,
    pause: float = LOG_PAUSE,
    step: float,
) -> Ride:
    """Simulates a ride that follows its references exactly, and measures it; a cheap way to find an effect's size."""
    times, starts, start, count = [], [], 0.0, 0
    motions = []
    for reference in references:
        t = np.arange(round(reference.duration / step)) * step
        motions.append(reference.at(t))
        times.append(t + start)
        starts.append(count)
        count += len(t)
        start += reference.duration + pause
    q, v, a = (np.concatenate(values) for values in zip(*motions, strict=True))
    ride = Ride(machine=machine, t=np.concatenate(times), starts=tuple(starts), q=q, v=v, a=a)
    measure(ride, effects)
    return ride


def projection_of(ride: Ride, level: np.ndarray) -> Projection:
    """Returns the projection off the base model for a ride's motion."""
    return Projection(base_regressor(ride.machine.known, ride.q, ride.v, ride.a, ride.sign), level)


def _closed_loop(
    machine: Machine, references: Sequence[Reference], clocks: Sequence[float], effects: Sequence[Effect]
) -> Ride:
    """Simulates the closed position loop: the motion is the reference minus the loop's error.

    For each joint m (e'' + 2 d w e' + w^2 e) = required torque - feed-forward torque.
    """
    times, wanted, starts, count = [], [], [], 0
    # Time [s] before each log in which the loop settles.
    lead_time = 1.0
    for reference, clock in zip(references, clocks, strict=True):
        t = np.arange(round((reference.duration + lead_time) / CONTROL_STEP)) * CONTROL_STEP - lead_time
        wanted.append(reference.at(t))
        times.append(t + clock)
        starts.append(count)
        count += len(t)
    q, v, a = (np.concatenate(values) for values in zip(*wanted, strict=True))
    ride = Ride(machine=machine, t=np.concatenate(times), starts=tuple(starts), q=q, v=v, a=a)
    smooth_part = ride.rigid + machine.rotor * a + machine.offset
    smooth_part = smooth_part - machine.feedforward * (
        rigid_torque(machine.known, q, v, a)
        + machine.known_rotor * a
        + friction_of(machine.known_friction, v, ride.sign)
    )
    ride.carried = _carried(ride, effects)
    for effect in effects:
        extra = effect.torque(ride)
        if extra is not None:
            smooth_part = smooth_part + extra
    inertia = _inertia(machine, q)
    error = _loop_error(ride, smooth_part, inertia)
    if any(parts_links(effect) for effect in effects):
        # Low-pass of the loop's error [s], as an effect moves links relative to their motors.
        error = [ride.smooth(values, 0.012) for values in error]
    keep = np.concatenate([np.arange(run.start + round(lead_time / CONTROL_STEP), run.stop) for run in ride.runs])
    lead = round(lead_time / CONTROL_STEP)
    return Ride(
        machine=machine,
        t=ride.t[keep],
        starts=tuple(start - lead * k for k, start in enumerate(starts)),
        q=(q - error[0])[keep],
        v=(v - error[1])[keep],
        a=(a - error[2])[keep],
    )


def _loop_error(ride: Ride, unforeseen: np.ndarray, inertia: np.ndarray) -> list[np.ndarray]:
    """Solves m (e'' + 2 d w e' + w^2 e) = unforeseen torque + friction(v - e') for e, e' and e'' of each joint.

    The solution is implicit in Coulomb friction, so that a joint can stick. The trapezoidal rule gives e from e', and
    central differences give e''. Both are of second order.
    """
    machine, h = ride.machine, CONTROL_STEP
    error, rate = np.empty_like(unforeseen), np.empty_like(unforeseen)
    for j, w in enumerate(machine.bandwidth):
        f1, f2, f3, f4 = machine.friction[j].tolist()
        width, m, w2 = float(machine.sign_width[j]), float(inertia[j]), float(w**2)
        c = float(1 + 2 * machine.damping * w * h + w2 * h**2 / 2)
        g = h * f1 / m
        for run in ride.runs:
            wanted, drive = ride.v[run, j].tolist(), (unforeseen[run, j] / m).tolist()
            first = f1 * float(np.tanh(wanted[0] / width)) / m
            e, s = (drive[0] + first) / w2, 0.0
            es, ss = [], []
            for v, d in zip(wanted, drive, strict=True):
                real = v - s
                slow = (f2 + f3 * abs(real) + f4 * real * real) * real / m
                x = c * v - s - h * (d + slow - w2 * (e + h * s / 2))
                # Solve c v' + g tanh(v' / width) = x for the joint's new velocity v'. From the solution with a linear
                # ramp for tanh, Newton's steps converge from one side, because tanh has one sign of curvature there.
                real = x / (c + g / width) if abs(x) <= c * width + g else (x - g if x > 0 else x + g) / c
                # Within six widths of the smooth sign Newton steps are needed.
                if abs(real) < 6.0 * width:
                    for _ in range(6):
                        sign = math.tanh(real / width)
                        real -= (c * real + g * sign - x) / (c + g / width * (1 - sign * sign))
                new = v - real
                e += h * (s + new) / 2
                s = new
                es.append(e)
                ss.append(s)
            error[run, j], rate[run, j] = es, ss
    return [error, rate, ride.derivative(rate)]


def _inertia(machine: Machine, q: np.ndarray) -> np.ndarray:
    data = machine.model.createData()
    diagonals = []
    for k in np.linspace(0, len(q) - 1, 50).astype(int):
        pin.crba(machine.model, data, q[k])
        diagonals.append(np.diag(data.M).copy())
    return np.mean(diagonals, axis=0) + machine.rotor

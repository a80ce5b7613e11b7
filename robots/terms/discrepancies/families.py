"""Families of free functions, which describe torque errors without a known cause."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.signal import lfilter

from robots.common.arrays import Array
from robots.common.stretches import spans
from robots.terms.columns import side_by_side
from robots.terms.discrepancies.gain_drift import half_waves, log_time
from robots.terms.discrepancies.resonance import resonance
from robots.terms.effect_bases.states import bristle
from robots.terms.effects import Situation

HARMONICS = (1, 2, 3, 4)
# Time constants [s] of the memory of velocity, of sensor creep, and of a drop of the supply voltage.
MEMORIES, CREEPS, SUPPLIES = (0.1, 0.3, 1.0, 3.0), (1.0, 3.0, 10.0, 30.0), (0.03, 0.15, 0.7)
# Time constants [s] of grease that thins under shear.
WORKED = (0.5, 2.0, 8.0)
# Numbers of half waves over time, for slow changes and for changes of a dependence on position.
TIME_WAVES, AGEING_WAVES = 8, 3
MOST_VELOCITY_PRODUCTS = 6  # largest number of further joints in products of velocities
# Changes of torque over which hysteresis changes sign, as fractions of the largest torque.
STRAINS = (0.05, 0.2, 0.6)
# Times [s] after the start of a motion between which the torque is linear; it is zero after the last.
SINCE = (0.0, 0.1, 0.2, 0.3, 0.5, 0.8)


@dataclass(frozen=True)
class Family:
    """Functions of one or two inputs.

    Attributes:
        columns: evaluates the functions (N, k) for a situation, the joint, another joint (both from 1) and the shape.
        count: the number k of functions.
        words: the dependence of the residual torque, with placeholders for the other joint and the shape.
        of: evaluates the joint's input (N,); its largest absolute value in the logs of the fit is the shape parameter
            that scales it, so that the functions are the same in other logs. None if the input is not scaled.
        unit: unit of that input.
    """

    columns: Callable[[Situation, int, int, tuple[float, ...]], Array]
    count: int
    words: str
    of: Callable[[Situation, int], Array] | None = None
    unit: str = ""


def _angle(s: Situation, joint: int, other: int, shape: tuple[float, ...]) -> Array:
    q = s.q[:, other - 1]
    return side_by_side([f(h * q) for h in HARMONICS for f in (np.cos, np.sin)])


def _angles(s: Situation, joint: int, other: int, shape: tuple[float, ...]) -> Array:
    if other == joint:
        return np.zeros((len(s), 16))
    a, b = s.q[:, joint - 1], s.q[:, other - 1]
    first = [f(h * a) for h in (1, 2) for f in (np.cos, np.sin)]
    second = [f(h * b) for h in (1, 2) for f in (np.cos, np.sin)]
    return side_by_side([x * y for x in first for y in second])


def _motion(s: Situation, joint: int, other: int, shape: tuple[float, ...]) -> Array:
    if other == joint:
        return np.zeros((len(s), 5))
    v = s.dq[:, other - 1]
    own = s.dq[:, joint - 1]
    return side_by_side([v, np.abs(v), v * np.abs(v), s.sign[:, other - 1], v * own])


def _push(s: Situation, joint: int, other: int, shape: tuple[float, ...]) -> Array:
    if other == joint:
        return np.zeros((len(s), 3))
    q, a = s.q[:, joint - 1], s.ddq[:, other - 1]
    return side_by_side([a, a * np.cos(q), a * np.sin(q)])


def _whirl(s: Situation, joint: int, other: int, shape: tuple[float, ...]) -> Array:
    columns = np.zeros((len(s), MOST_VELOCITY_PRODUCTS))
    further = (
        [k for k in range(s.q.shape[1]) if k + 1 not in (joint, other)][:MOST_VELOCITY_PRODUCTS]
        if other != joint
        else []
    )
    columns[:, : len(further)] = s.dq[:, other - 1, None] * s.dq[:, further]
    return columns


def _drag(s: Situation, joint: int, other: int, shape: tuple[float, ...]) -> Array:
    return _products(s.q[:, joint - 1], s.dq[:, other - 1])


def _posture(s: Situation, joint: int, other: int, shape: tuple[float, ...]) -> Array:
    if other == joint:
        return np.zeros((len(s), 8))
    return _products(s.q[:, other - 1], s.dq[:, joint - 1])


def _products(q: Array, v: Array) -> Array:
    waves = [f(h * q) for h in (1, 2) for f in (np.cos, np.sin)]
    return side_by_side([wave * speed for wave in waves for speed in (v, v * v)])


def _speed_of(s: Situation, joint: int) -> Array:
    return np.asarray(np.abs(s.dq[:, joint - 1]))


def _load_of(s: Situation, joint: int) -> Array:
    return np.asarray(s.load[:, joint - 1])


def _torque_of(s: Situation, joint: int) -> Array:
    return np.asarray(s.torque[:, joint - 1])


def _acceleration_of(s: Situation, joint: int) -> Array:
    return np.asarray(s.ddq[:, joint - 1])


def _speed(s: Situation, joint: int, other: int, shape: tuple[float, ...]) -> Array:
    x = _speed_of(s, joint) / shape[0]
    centres = (0.0, 0.05, 0.15, 0.35, 0.65, 1.0)
    widths = (0.03, 0.06, 0.1, 0.2, 0.25, 0.3)
    return side_by_side([np.exp(-0.5 * ((x - c) / w) ** 2) for c, w in zip(centres, widths, strict=True)])


def _load(s: Situation, joint: int, other: int, shape: tuple[float, ...]) -> Array:
    x = _load_of(s, joint) / shape[0]
    return side_by_side([x, np.abs(x), x * np.abs(x), x**2, np.abs(x) ** 3])


def _torque(s: Situation, joint: int, other: int, shape: tuple[float, ...]) -> Array:
    x = _torque_of(s, joint) / shape[0]
    return side_by_side([np.tanh(x / 0.05), np.tanh(x / 0.2), x * np.abs(x), x**3, np.abs(x), x**2])


def _acceleration(s: Situation, joint: int, other: int, shape: tuple[float, ...]) -> Array:
    x = _acceleration_of(s, joint) / shape[0]
    return side_by_side([np.abs(x), x * np.abs(x), x**3])


def _memory(s: Situation, joint: int, other: int, shape: tuple[float, ...]) -> Array:
    return _followers(s, s.dq[:, joint - 1], MEMORIES)


def _worked(s: Situation, joint: int, other: int, shape: tuple[float, ...]) -> Array:
    speed = np.abs(s.dq[:, joint - 1]) / shape[0]
    before = _followers(s, speed, WORKED)
    return np.hstack([before, before * speed[:, None]])


def _creep(s: Situation, joint: int, other: int, shape: tuple[float, ...]) -> Array:
    return _followers(s, s.torque[:, joint - 1], CREEPS)


def _hysteresis(s: Situation, joint: int, other: int, shape: tuple[float, ...]) -> Array:
    torque = _torque_of(s, joint) / shape[0]
    rate = np.concatenate([np.gradient(torque[run], s.period) if run.stop - run.start > 1 else [0.0] for run in s.runs])
    return side_by_side([bristle(s.t, torque, rate, s.runs, length) for length in STRAINS])


def _supply(s: Situation, joint: int, other: int, shape: tuple[float, ...]) -> Array:
    power = np.sum(s.torque * s.dq, axis=1)
    power = _followers(s, power / max(float(np.abs(power).max(initial=0.0)), 1e-300), SUPPLIES)
    return s.torque[:, joint - 1, None] * np.hstack([power, np.abs(power)])


def _followers(s: Situation, source: Array, memories: tuple[float, ...]) -> Array:
    """Filters a source (N,) by first-order low-passes with k time constants [s] (N, k), starting at each log's mean.

    A start from zero would cause a transient that resembles a drift at the log's start.
    """
    columns = np.zeros((len(s), len(memories)))
    for k, memory in enumerate(memories):
        keep = float(np.exp(-s.period / memory))
        for run in s.runs:
            columns[run, k] = lfilter([1 - keep], [1.0, -keep], source[run], zi=[keep * source[run].mean()])[0]
    return columns


def _time(s: Situation, joint: int, other: int, shape: tuple[float, ...]) -> Array:
    return half_waves(log_time(s), TIME_WAVES)


def _ageing(s: Situation, joint: int, other: int, shape: tuple[float, ...]) -> Array:
    q = s.q[:, joint - 1]
    slow = half_waves(log_time(s), AGEING_WAVES)
    return np.hstack([slow * wave[:, None] for wave in (np.cos(q), np.sin(q))])


def _start(s: Situation, joint: int, other: int, shape: tuple[float, ...]) -> Array:
    v = np.abs(s.dq[:, joint - 1])
    # At rest, the speed is below 2 % of the joint's RMS speed.
    still = v < 0.02 * float(np.sqrt(np.mean(v**2)))
    columns = np.zeros((len(s), len(SINCE) - 1))
    for run in s.runs:
        t, own = s.t[run], columns[run]
        # A rest lasts 0.1 s at least.
        goes = [stop for start, stop in spans(still[run]) if (stop - start) * s.period >= 0.1 and stop < len(t)]
        for start, stop in pairwise([*goes, len(t)]):
            since = t[start:stop] - t[start]
            own[start:stop] = np.column_stack([np.interp(since, SINCE, peak) for peak in np.eye(len(SINCE))[:-1]])
    return columns


def _ringing(s: Situation, joint: int, other: int, shape: tuple[float, ...]) -> Array:
    sources = side_by_side([s.rigid[:, joint - 1], s.ddq[:, joint - 1]])
    for run in s.runs:
        sources[run] -= sources[run].mean(axis=0)
    place, rate = resonance(s, sources, shape[0])
    return side_by_side([place[:, 0], rate[:, 0], place[:, 1], rate[:, 1]])


def _vibration(s: Situation, joint: int, other: int, shape: tuple[float, ...]) -> Array:
    phase = 2 * np.pi * shape[0] * (s.t - s.origin)
    pull = s.sensitivity("gravity")[:, joint - 1]
    size = np.abs(pull).max(axis=0)
    # For an axis along gravity the sensitivity is zero up to rounding.
    pull = np.where(size > 1e-6 * max(float(size.max()), 1e-300), pull, 0.0)
    if not float(size.max()) > 1e-9:
        pull = np.ones((len(s), 1)) * [1.0, 0.0, 0.0]
    waves = (np.cos(phase), np.sin(phase))
    columns = [wave * pull[:, i % pull.shape[1]] for i in range(3) for wave in waves]
    return side_by_side([*columns, *waves])


def _sway(s: Situation, joint: int, other: int, shape: tuple[float, ...]) -> Array:
    phase = 2 * np.pi * shape[0] * (s.t - s.origin)
    return side_by_side([np.cos(phase), np.sin(phase)])


def _turns(s: Situation, joint: int, other: int, shape: tuple[float, ...]) -> Array:
    q, v, a = (x[:, joint - 1] for x in (s.q, s.dq, s.ddq))
    waves = (np.cos(shape[0] * q), np.sin(shape[0] * q))
    # Effect of a periodic position error through stiffness, friction and inertia.
    return side_by_side([wave * factor for factor in (np.ones(len(s)), v, v**2, a) for wave in waves])


FAMILIES: dict[str, Family] = {
    "angle": Family(_angle, 8, "depends on the position of {who}"),
    "angles": Family(_angles, 16, "depends on its own position and that of {who} together"),
    "motion": Family(_motion, 5, "depends on the velocity of {who}"),
    "push": Family(_push, 3, "depends on the acceleration of {who}"),
    "whirl": Family(
        _whirl, MOST_VELOCITY_PRODUCTS, "depends on products of the velocity of {who} and those of other joints"
    ),
    "drag": Family(_drag, 8, "depends on its own position and the velocity of {who} together"),
    "posture": Family(_posture, 8, "depends on its own velocity and the position of {who} together"),
    "speed": Family(_speed, 6, "depends on the speed of the joint", _speed_of, "rad/s or m/s"),
    "load": Family(_load, 5, "depends on the load of the joint", _load_of, "N m or N"),
    "torque": Family(_torque, 6, "depends nonlinearly on the torque of the joint", _torque_of, "N m or N"),
    "acceleration": Family(
        _acceleration,
        3,
        "depends nonlinearly on the acceleration of the joint",
        _acceleration_of,
        "rad/s2 or m/s2",
    ),
    "memory": Family(_memory, 4, "depends on the recent velocity of the joint"),
    "worked": Family(_worked, 2 * len(WORKED), "depends on the joint's earlier speed", _speed_of, "rad/s or m/s"),
    "creep": Family(_creep, 4, "depends on the recent torque of the joint"),
    "hysteresis": Family(
        _hysteresis, len(STRAINS), "differs between rising and falling torque (hysteresis)", _torque_of, "N m or N"
    ),
    "supply": Family(_supply, 6, "depends on the joint's torque and the power of all joints together"),
    "time": Family(_time, TIME_WAVES, "changes slowly with time"),
    "ageing": Family(_ageing, 2 * AGEING_WAVES, "depends on the joint's position and changes slowly with time"),
    "start": Family(_start, len(SINCE) - 1, "differs for some time after a standstill of the joint"),
    "ringing": Family(_ringing, 4, "rings at {point} Hz, excited by the motion"),
    "vibration": Family(_vibration, 8, "vibrates at {point} Hz, independent of the motion"),
    "sway": Family(_sway, 2, "oscillates at {point} Hz, independent of the motion"),
    "turns": Family(_turns, 8, "repeats {point} times a turn of the joint and grows with its speed"),
}

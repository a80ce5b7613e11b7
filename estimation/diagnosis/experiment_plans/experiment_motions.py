"""Simple motions that separate causes, within the positions, speeds and accelerations that the logs have shown."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from estimation.diagnosis.recordings.log_reading import Recording
from robots.robot import Robot
from robots.signals import Motion
from robots.terms.effects.base_tilt import level_axes

Array = NDArray[np.float64]

REFERENCE = 40.0
"""Length of the logged motion that experiments repeat [s]."""
EASE = 2.0
"""Time in which a motion begins and ends [s]."""
SLOWEST = 20.0
"""Longest move from point to point [s]: a joint that the logs show at rest has no speed to go by."""
PAUSE = 300.0
"""A pause in which a warm joint cools [s]."""
TILT = np.radians(15.0)
"""Angle by which a base is tilted for a second pose."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Stage:
    """A part of an experiment.

    Attributes:
        motion: its time starts at zero.
        pause: rest before it [s].
        payload: mass of a known payload at the flange [kg]; its centre lies a tenth of a metre ahead.
        gravity: (3,) in the base frame, where the base stands otherwise than it did; None as it did.
    """

    motion: Motion
    pause: float = 2.0
    payload: float = 0.0
    gravity: Array | None = None


@dataclass(frozen=True, kw_only=True, eq=False)
class MotionRange:
    """What an experiment may use.

    Attributes:
        robot: the robot.
        lower: least positions that the logs have shown (n,).
        upper: largest (n,).
        speed: largest speed (n,).
        acceleration: largest acceleration (n,).
        reference: a motion of the logs.
        logged: which that is, in words.
        step: sample period [s].
        payload: mass of a payload that the robot carries well [kg].
    """

    robot: Robot
    lower: Array
    upper: Array
    speed: Array
    acceleration: Array
    reference: Motion
    step: float
    payload: float
    logged: str = ""

    @property
    def middle(self) -> Array:
        """The middle of the positions (n,)."""
        return (self.lower + self.upper) / 2


def motion_range(robot: Robot, recording: Recording) -> MotionRange:
    """Measures the room that the logs have shown; limits of the robot that are tighter count."""
    lengths = [part.stop - part.start for part in recording.runs]
    longest = int(np.argmax(lengths))
    run = recording.runs[longest]
    rows = slice(run.start, min(run.stop, run.start + round(REFERENCE / recording.step)))
    t = recording.t[rows] - recording.t[rows.start]
    limits = robot.limits
    speed = np.abs(recording.dq).max(axis=0)
    acceleration = np.abs(recording.ddq).max(axis=0)
    first, last = recording.t[rows][[0, -1]]
    mass = float(np.nansum(robot.inertia[:, 0])) if robot.has_inertia else 40.0
    return MotionRange(
        robot=robot,
        lower=np.maximum(recording.q.min(axis=0), limits.lower),
        upper=np.minimum(recording.q.max(axis=0), limits.upper),
        speed=np.minimum(1.2 * speed, _known(limits.velocity)),
        acceleration=np.minimum(2.0 * acceleration, _known(limits.acceleration)),
        reference=Motion(t, recording.q[rows], recording.dq[rows], recording.ddq[rows]),
        step=recording.step,
        payload=0.8 * robot.payload if robot.payload else max(0.05 * mass, 0.1),
        logged=f"{recording.names[longest]} from t = {first:.4g} to {last:.4g} s",
    )


def _known(limit: Array) -> Array:
    """Nine tenths of limits (n,); infinite where a description leaves them out, which some write as zero."""
    return np.where(np.isfinite(limit) & (limit > 0), 0.9 * limit, np.inf)


def _motion(room: MotionRange, q: NDArray[Any]) -> Motion:
    """Differentiates positions (N, n) that are smooth."""
    t = np.asarray(room.step * np.arange(len(q)))
    dq = np.asarray(np.gradient(q, room.step, axis=0))
    return Motion(t, q, dq, np.asarray(np.gradient(dq, room.step, axis=0)))


def at_rate(motion: Motion, period: float) -> Motion:
    """Samples a motion of this module anew, at a controller's period [s]."""
    t = np.asarray(period * np.arange(int(motion.duration / period + 1e-6) + 1))
    spline = CubicSpline(motion.t, motion.q)
    return Motion(t, *(np.asarray(spline(t, order)) for order in range(3)))


def _ease(share: NDArray[Any]) -> NDArray[Any]:
    """From 0 to 1 without jerk: 10 s^3 - 15 s^4 + 6 s^5."""
    s = np.clip(share, 0.0, 1.0)
    return s**3 * (10 - 15 * s + 6 * s**2)


def _rested(room: MotionRange, q: NDArray[Any]) -> NDArray[Any]:
    """Lets positions (N, n) begin and end at rest in the middle, over two seconds each."""
    t = room.step * np.arange(len(q))
    share = _ease(t / EASE) * _ease((t[-1] - t) / EASE)
    return room.middle + share[:, None] * (q - room.middle)


def _visit(room: MotionRange, points: Array, rest: float) -> Array:
    """Moves from point to point (K, n), with a rest [s] at each."""
    parts = [np.repeat(points[:1], max(round(rest / room.step), 1), axis=0)]
    for start, end in pairwise(points):
        way = np.abs(end - start)
        with np.errstate(divide="ignore", invalid="ignore"):
            needed = np.maximum(1.875 * way / room.speed, np.sqrt(5.774 * way / room.acceleration))
        duration = float(np.clip(needed[way > 0].max(initial=0.0), 0.2, SLOWEST))
        count = max(round(duration / room.step), 2)
        parts.append(start + _ease(np.arange(1, count + 1) / count)[:, None] * (end - start))
        parts.append(np.repeat(end[None], round(rest / room.step), axis=0))
    return np.concatenate(parts)


def _alone(room: MotionRange, joint: int, x: Array) -> Array:
    """One joint, counted from 0, takes positions (N,), the others the middle."""
    q = np.repeat(room.middle[None], len(x), axis=0)
    q[:, joint] = x
    return q


def sweep(room: MotionRange, joint: int, variant: int) -> tuple[Stage, ...]:
    """Runs one joint there and back at constant speeds, each twice the last, at most 8 s a stroke."""
    reach = float(room.upper[joint] - room.lower[joint])
    top, a = float(room.speed[joint]), float(room.acceleration[joint])
    parts = [_alone(room, joint, np.full(2, room.lower[joint]))]
    for speed in top * 2.0 ** -np.arange(0.0, 7.0 + 0.5 * (variant % 2), 1.0):
        ramp = max(1.875 * speed / max(a, 1e-9), 5 * room.step)
        length = min(reach, 8.0 * speed)
        if length <= speed * ramp:
            continue
        hold = length / speed - ramp
        t = room.step * np.arange(round((hold + 2 * ramp) / room.step) + 1)
        way = np.cumsum(speed * _ease(t / ramp) * _ease((hold + 2 * ramp - t) / ramp)) * room.step
        way *= min(1.0, reach / max(float(way[-1]), 1e-12))
        start = float(room.lower[joint]) + variant % 3 * (reach - way[-1]) / 3
        stroke = _alone(room, joint, np.concatenate([start + way, start + way[-1] - way]))
        parts += [_visit(room, np.stack([parts[-1][-1], stroke[0]]), 0.1), stroke]
    return (Stage(motion=_motion(room, np.concatenate(parts))),)


def pause(room: MotionRange, joint: int, variant: int) -> tuple[Stage, ...]:
    """Repeats the logged motion three times, rests, and repeats it once more."""
    again = Stage(motion=room.reference)
    return (again, again, again, Stage(motion=room.reference, pause=PAUSE))


def static_hold(room: MotionRange, joint: int, variant: int) -> tuple[Stage, ...]:
    """Holds sixteen poses for a second and a half each."""
    random = np.random.default_rng(variant)
    points = room.lower + random.random((16, room.robot.n)) * (room.upper - room.lower)
    return (Stage(motion=_motion(room, _visit(room, points, 1.5))),)


def payload(room: MotionRange, joint: int, variant: int) -> tuple[Stage, ...]:
    """Makes the logged motion without and with a known payload."""
    return (Stage(motion=room.reference), Stage(motion=room.reference, pause=60.0, payload=room.payload))


def single_joint(room: MotionRange, joint: int, variant: int) -> tuple[Stage, ...]:
    """Makes the logged motion of one joint, then of its neighbour, the others at rest."""
    joints = [joint, joint - 1 if joint else min(1, room.robot.n - 1)]
    return tuple(
        Stage(motion=_motion(room, _rested(room, _alone(room, j, room.reference.q[:, j]))))
        for j in dict.fromkeys(joints)
    )


def micro_reversals(room: MotionRange, joint: int, variant: int) -> tuple[Stage, ...]:
    """Turns one joint back and forth, ever less far: from a third of its range to a thousandth of it."""
    largest = 0.3 * float(room.upper[joint] - room.lower[joint])
    periods = 4.0 * np.arange(0, 8)
    rate = 2 * np.pi * min(0.25, float(room.speed[joint]) / max(2 * np.pi * largest, 1e-9))
    cycle = 2 * np.pi / max(rate, 0.3)
    t = room.step * np.arange(round(32 * cycle / room.step))
    level = np.interp(t / cycle, periods, np.log(largest) - 0.9 * np.arange(8)) if largest > 0 else np.zeros(len(t))
    x = room.middle[joint] + (np.exp(level) if largest > 0 else 0.0) * np.sin(2 * np.pi * t / cycle)
    return (Stage(motion=_motion(room, _rested(room, _alone(room, joint, x)))),)


def mirrored(room: MotionRange, joint: int, variant: int) -> tuple[Stage, ...]:
    """Makes the logged motion forwards, then backwards in time."""
    m = room.reference
    back = Motion(m.t, m.q[::-1], -m.dq[::-1], m.ddq[::-1])
    return (Stage(motion=m), Stage(motion=back))


def second_base_pose(room: MotionRange, joint: int, variant: int) -> tuple[Stage, ...]:
    """Makes the logged motion on a base that is tilted by 15 degrees."""
    gravity = np.asarray(room.robot.chain.gravity, dtype=float)
    axis = level_axes(gravity)[variant % 2] if gravity.any() else np.zeros(3)
    # Rodrigues for an axis across gravity.
    tilted = gravity * np.cos(TILT) + np.cross(axis, gravity) * np.sin(TILT)
    return (Stage(motion=room.reference, gravity=tilted),)


def multisine(room: MotionRange, joint: int, variant: int) -> tuple[Stage, ...]:
    """Moves all joints with frequencies up to 6 Hz, as fast as the accelerations allow."""
    random = np.random.default_rng(variant)
    t = room.step * np.arange(round(REFERENCE / room.step))
    f = np.geomspace(0.1, min(6.0, 0.1 / room.step), 24)
    q = np.empty((len(t), room.robot.n))
    for j in range(room.robot.n):
        w = 2 * np.pi * f * (1 + 0.02 * j)
        phase = random.uniform(0, 2 * np.pi, len(w))
        angle = t[:, None] * w + phase
        size = 1.0 / w**1.5
        x = np.sin(angle) @ size
        rates = (np.abs(np.cos(angle) @ (size * w)).max(), np.abs(np.sin(angle) @ (size * w**2)).max())
        reach = (room.upper[j] - room.lower[j]) / max(np.ptp(x), 1e-9)
        scale = min(reach, room.speed[j] / rates[0], room.acceleration[j] / rates[1])
        q[:, j] = room.middle[j] + scale * (x - (x.max() + x.min()) / 2)
    return (Stage(motion=_motion(room, _rested(room, q))),)


def repeat(room: MotionRange, joint: int, variant: int) -> tuple[Stage, ...]:
    """Makes the logged motion again."""
    return (Stage(motion=room.reference),)


MAKERS: dict[str, Callable[[MotionRange, int, int], tuple[Stage, ...]]] = {
    "repeat": repeat,
    "mirrored": mirrored,
    "single_joint": single_joint,
    "sweep": sweep,
    "micro_reversals": micro_reversals,
    "multisine": multisine,
    "static_hold": static_hold,
    "pause": pause,
    "payload": payload,
    "second_base_pose": second_base_pose,
}
"""By kind, the least trouble first: each makes the stages for a joint, counted from 0, in several variants."""
MADE = {"single_joint", "sweep", "micro_reversals", "multisine", "static_hold"}
"""Kinds whose motions are new; the others repeat a motion of the logs."""
VARIED = {"sweep", "static_hold", "multisine", "second_base_pose"}
"""Kinds whose variants differ."""

"""Simple motions that separate causes, within the positions of the logs and near their speeds and accelerations."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from estimation.diagnosis.recordings.recording import Recording
from robots.common.arrays import Array
from robots.robot import Robot
from robots.signals import Motion
from robots.terms.effects.base_tilt import level_axes

REFERENCE = 40.0
"""Longest part of a logged motion that experiments repeat [s]."""
EASE = 2.0
"""Duration of the smooth start and end of a motion [s]."""
SLOWEST = 20.0
"""Longest move between two points [s], for joints without a known speed because they rest in the logs."""
PAUSE = 300.0
"""Pause in which warm joints cool [s]."""
TILT = np.radians(15.0)
"""Tilt of the base for a second pose [rad]."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Stage:
    """One part of an experiment.

    Attributes:
        motion: its time starts at zero.
        pause: rest before it [s].
        payload: mass of a known payload [kg], its centre 0.1 m ahead of the flange.
        gravity: (3,) in the base frame [m/s2] if the base is tilted; None if it is not moved.
    """

    motion: Motion
    pause: float = 2.0
    payload: float = 0.0
    gravity: Array | None = None


@dataclass(frozen=True, kw_only=True, eq=False)
class MotionRange:
    """Limits and reference motion for experiments.

    Attributes:
        robot: the robot.
        lower: lower end of the logged positions, within the robot's limits (n,) [rad or m].
        upper: upper end (n,).
        speed: largest speed (n,) [rad/s or m/s].
        acceleration: largest acceleration (n,) [rad/s2 or m/s2].
        reference: a motion of the logs.
        step: sample period [s].
        payload: mass of a payload well below the robot's rated one [kg].
        logged: name of that motion's log, and its time, in words.
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
        """Middle of the positions (n,)."""
        return (self.lower + self.upper) / 2


def motion_range(robot: Robot, recording: Recording) -> MotionRange:
    """Derives the range of experiments from the logs and the robot's limits."""
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
    """Returns 90 % of limits (n,); infinite for missing ones, which some descriptions write as zero."""
    return np.where(np.isfinite(limit) & (limit > 0), 0.9 * limit, np.inf)


def _motion(room: MotionRange, q: NDArray[Any]) -> Motion:
    """Differentiates smooth positions (N, n)."""
    t = np.asarray(room.step * np.arange(len(q)))
    dq = np.asarray(np.gradient(q, room.step, axis=0))
    return Motion(t, q, dq, np.asarray(np.gradient(dq, room.step, axis=0)))


def backwards(motion: Motion) -> Motion:
    """Reverses a motion in time."""
    return Motion(motion.t, motion.q[::-1], -motion.dq[::-1], motion.ddq[::-1])


def at_rate(motion: Motion, period: float) -> Motion:
    """Resamples a motion of this module.

    Args:
        motion: the motion.
        period: the controller's period [s].
    """
    t = np.asarray(period * np.arange(int(motion.duration / period + 1e-6) + 1))
    spline = CubicSpline(motion.t, motion.q)
    return Motion(t, *(np.asarray(spline(t, order)) for order in range(3)))


def _ease(share: NDArray[Any]) -> NDArray[Any]:
    """Returns a smooth step from 0 to 1: 10 s^3 - 15 s^4 + 6 s^5."""
    s = np.clip(share, 0.0, 1.0)
    return s**3 * (10 - 15 * s + 6 * s**2)


def _rested(room: MotionRange, q: NDArray[Any]) -> NDArray[Any]:
    """Makes positions (N, n) start and end at rest in the middle of the range."""
    t = room.step * np.arange(len(q))
    share = _ease(t / EASE) * _ease((t[-1] - t) / EASE)
    return room.middle + share[:, None] * (q - room.middle)


def _visit(room: MotionRange, points: Array, rest: float) -> Array:
    """Moves through points (K, n), with a rest [s] at each."""
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
    """Returns positions (N, n) in which one joint, from 0, follows x (N,) and the others stay in the middle."""
    q = np.repeat(room.middle[None], len(x), axis=0)
    q[:, joint] = x
    return q


def sweep(room: MotionRange, joint: int, variant: int) -> tuple[Stage, ...]:
    """Moves one joint back and forth at constant speeds, each half the one before, at most about 8 s per stroke."""
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
    """Repeats the logged motion three times, and once more after a pause."""
    again = Stage(motion=room.reference)
    return (again, again, again, Stage(motion=room.reference, pause=PAUSE))


def static_hold(room: MotionRange, joint: int, variant: int) -> tuple[Stage, ...]:
    """Holds 16 random poses for 1.5 s each."""
    random = np.random.default_rng(variant)
    points = room.lower + random.random((16, room.robot.n)) * (room.upper - room.lower)
    return (Stage(motion=_motion(room, _visit(room, points, 1.5))),)


def payload(room: MotionRange, joint: int, variant: int) -> tuple[Stage, ...]:
    """Repeats the logged motion without and with a known payload."""
    return (Stage(motion=room.reference), Stage(motion=room.reference, pause=60.0, payload=room.payload))


def single_joint(room: MotionRange, joint: int, variant: int) -> tuple[Stage, ...]:
    """Repeats the logged motion of one joint, then of its neighbour, with the others at rest."""
    joints = [joint, joint - 1 if joint else min(1, room.robot.n - 1)]
    return tuple(
        Stage(motion=_motion(room, _rested(room, _alone(room, j, room.reference.q[:, j]))))
        for j in dict.fromkeys(joints)
    )


def micro_reversals(room: MotionRange, joint: int, variant: int) -> tuple[Stage, ...]:
    """Moves one joint back and forth with decreasing amplitude, from 0.3 to less than 0.001 of its range."""
    largest = 0.3 * float(room.upper[joint] - room.lower[joint])
    periods = 4.0 * np.arange(0, 8)
    rate = 2 * np.pi * min(0.25, float(room.speed[joint]) / max(2 * np.pi * largest, 1e-9))
    cycle = 2 * np.pi / max(rate, 0.3)
    t = room.step * np.arange(round(32 * cycle / room.step))
    level = np.interp(t / cycle, periods, np.log(largest) - 0.9 * np.arange(8)) if largest > 0 else np.zeros(len(t))
    x = room.middle[joint] + (np.exp(level) if largest > 0 else 0.0) * np.sin(2 * np.pi * t / cycle)
    return (Stage(motion=_motion(room, _rested(room, _alone(room, joint, x)))),)


def mirrored(room: MotionRange, joint: int, variant: int) -> tuple[Stage, ...]:
    """Repeats the logged motion, then the same backwards in time."""
    return (Stage(motion=room.reference), Stage(motion=backwards(room.reference)))


def second_base_pose(room: MotionRange, joint: int, variant: int) -> tuple[Stage, ...]:
    """Repeats the logged motion on a base tilted by 15 degrees."""
    gravity = np.asarray(room.robot.chain.gravity, dtype=float)
    axis = level_axes(gravity)[variant % 2] if gravity.any() else np.zeros(3)
    # Rodrigues' formula for an axis perpendicular to gravity.
    tilted = gravity * np.cos(TILT) + np.cross(axis, gravity) * np.sin(TILT)
    return (Stage(motion=room.reference, gravity=tilted),)


def multisine(room: MotionRange, joint: int, variant: int) -> tuple[Stage, ...]:
    """Moves all joints with frequencies up to 6 Hz, as fast as speeds and accelerations allow."""
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
    """Repeats the logged motion."""
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
"""Function that builds the stages of each kind, from range, joint (from 0) and variant; the simplest kind first."""
MADE = {"single_joint", "sweep", "micro_reversals", "multisine", "static_hold"}
"""Kinds with new motions; the others repeat a motion of the logs."""
VARIED = {"sweep", "static_hold", "multisine", "second_base_pose"}
"""Kinds whose variants differ."""

"""States that several effects share: stored heat, the presliding state, and candidate times of changes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.signal import lfilter

from robots.common.arrays import Array
from robots.robot import Robot
from robots.terms.situations.situation import Situation

SCANNED_CHANGES = 24
"""Number of change times in a scan: a step between two of them loses at most a tenth of its energy."""


def relaxation(situation: Situation, source: Array, time_constant: float) -> Array:
    """Integrates x' = source - x / time_constant from zero.

    The integration is exact for a source that is constant between two samples, at their mean. In the pauses between
    logs the source is zero, and x decays over the real time of the pause.

    Args:
        situation: the samples' times and logs.
        source: (N,) per second.
        time_constant: [s].

    Returns:
        x (N,): the source's unit times seconds.
    """
    x = np.zeros(len(source))
    level, last = 0.0, float(situation.t[0])
    for run in situation.runs:
        t, u = situation.t[run], source[run]
        level *= float(np.exp(-(t[0] - last) / time_constant))
        x[run] = _relax(t, u, time_constant, level)
        level, last = float(x[run.stop - 1]), float(t[-1])
    return x


def _relax(t: Array, u: Array, time_constant: float, level: float) -> Array:
    if len(t) < 2:
        return np.full(len(t), level)
    steps = np.diff(t)
    step = float(steps.mean())
    if np.abs(steps - step).max() > 1e-3 * step:
        # Heat is slow, so interpolation on an even grid of the median step is accurate enough.
        even = np.linspace(t[0], t[-1], int(np.ceil((t[-1] - t[0]) / max(float(np.median(steps)), 1e-6))) + 1)
        return np.interp(t, even, _relax(even, np.interp(even, t, u), time_constant, level))
    decay = float(np.exp(-step / time_constant))
    driven = np.concatenate([[0.0], (u[:-1] + u[1:]) / 2]) * (time_constant * (1.0 - decay))
    driven[0] = level
    return np.asarray(lfilter([1.0], [1.0, -decay], driven))


def bristle(t: Array, q: Array, dq: Array, runs: tuple[slice, ...], length: float) -> Array:
    """Evaluates the presliding state of Dahl's model, dz/dq = 1 - sign(dq) z / length, scaled to z / length.

    Between two reversals the solution is in closed form: z approaches its limit with exp(-travel / length). A reversal
    between two samples is located by linear interpolation of the velocity, because `length` may be shorter than the
    travel between samples. A log starts with z at its limit if the joint moves, and at zero if it rests.

    Args:
        t: time (N,) [s].
        q: positions of one joint (N,) [rad or m].
        dq: its velocities (N,) [rad/s or m/s].
        runs: the logs' rows.
        length: travel over which friction changes sign [rad or m].

    Returns:
        z / length (N,), between -1 and 1.
    """
    return np.concatenate([_bristle(t[run], q[run], dq[run], length) for run in runs])


def _bristle(t: Array, q: Array, dq: Array, length: float) -> Array:
    moving = np.flatnonzero(dq)
    if not len(moving):
        return np.zeros(len(q))
    # A joint at rest keeps the sign of its last velocity.
    way = np.sign(dq[moving[np.maximum(np.searchsorted(moving, np.arange(len(q)), side="right") - 1, 0)]])
    turns = np.flatnonzero(np.diff(way))
    before, after = np.abs(dq[turns]), np.abs(dq[turns + 1])
    share = before / np.maximum(before + after, 1e-300)
    places = np.concatenate([q[:1], q[turns] + 0.5 * dq[turns] * share * (t[turns + 1] - t[turns])])
    directions = way[np.concatenate([[0], turns + 1])]
    decays = np.exp(-np.abs(np.diff(places)) / length)
    starts = np.empty(len(places))
    # Fraction of a joint's largest speed above which a log starts in motion, with fully developed friction.
    z = float(directions[0]) if abs(dq[0]) > 0.01 * np.abs(dq).max() else 0.0
    for k, (direction, decay) in enumerate(zip(directions.tolist(), [*decays.tolist(), 1.0], strict=True)):
        starts[k] = z
        z = direction + (z - direction) * decay
    leg = np.repeat(np.arange(len(places)), np.diff(np.concatenate([[0], turns + 1, [len(q)]])))
    return directions[leg] + (starts - directions)[leg] * np.exp(-np.abs(q - places[leg]) / length)


def change_times(situation: Situation, count: int = SCANNED_CHANGES) -> tuple[float, ...]:
    """Returns candidate times [s] of a change: `count` evenly spaced samples, and the start of each further log."""
    N = len(situation)
    inside = {int(N * (k + 0.5) / count) for k in range(count)} if 4 * count < N else set()
    between = set(situation.starts[1:]) if len(situation.starts) <= 2 * count else set()
    return tuple(float(situation.t[i]) for i in sorted(inside | between) if 0 < i < N)


def best_apart(scores: Array, count: int, apart: int) -> list[int]:
    """Returns the indices of the highest scores (K,), the best first, more than `apart` indices from each other."""
    left = np.where(np.isnan(scores), -np.inf, scores)
    chosen: list[int] = []
    while len(chosen) < count and np.isfinite(left).any():
        best = int(np.argmax(left))
        chosen.append(best)
        left[max(best - apart, 0) : best + apart + 1] = -np.inf
    return chosen


def spells(situation: Situation, durations: Sequence[float]) -> tuple[tuple[float, float], ...]:
    """Lists time windows (start [s], duration [s]) within the logs, with starts half a duration apart."""
    return tuple(
        (float(start), duration)
        for duration in durations
        for run in situation.runs
        for start in np.arange(situation.t[run.start], situation.t[run.stop - 1] - duration / 2, duration / 2)
    )


def moving_speed(situation: Situation, joint: int) -> tuple[float, float]:
    """Returns the 1 % quantile and the maximum of a joint's speed while it moves; zeros if it never moves.

    Speeds below a ten-thousandth of the largest count as rest: they are ripple of the smoothing filter.
    """
    speed = np.abs(situation.dq[:, joint - 1])
    top = float(speed.max(initial=0.0))
    moving = speed[speed > 1e-4 * top]
    return (float(np.quantile(moving, 0.01)), top) if top > 1e-9 else (0.0, 0.0)


def torque_reference(robot: Robot, joint: int) -> float:
    """Returns a joint's torque limit [N m or N], or 100 where it has none."""
    limit = float(robot.limits.torque[joint - 1])
    return limit if np.isfinite(limit) and limit > 0 else 100.0

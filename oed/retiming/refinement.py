"""A given timing made faster, or feasible, without leaving its path: jerk, torque and friction included."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.interpolate import PPoly

from oed.retiming.barrier import inside, shorten
from oed.retiming.limits import limit_usage
from oed.retiming.speed_law import SpeedGrid, SpeedLaw
from oed.retiming.timing_problem import Friction, InverseDynamics, TimingProblem
from robots.common.arrays import Array
from robots.limits import Limits, finite_jerk
from robots.signals import Motion

Torque = Callable[[Motion], Array | None]

ORDERS = {"velocity": 1.0, "acceleration": 2.0, "jerk": 3.0, "torque": 2.0}
"""The powers of speed with which quantities grow."""


def refine(
    motion: Motion,
    limits: Limits,
    *,
    period: float,
    inverse_dynamics: InverseDynamics | None = None,
    friction: Friction | None = None,
) -> Motion | None:
    """Changes the timing of a motion that rests without acceleration at both ends, as fast as the limits allow.

    Begins with the motion's own timing, uniformly slowed until it fits, and only ever gets faster from there. Where
    the samples that come out pass a limit that the grid did not see, that limit is tightened there; what is still left
    over after some rounds is stretched.

    Args:
        motion: the path and a timing that is smooth: its jerk is finite.
        limits: with finite velocity and acceleration.
        period: the controller's period [s].
        inverse_dynamics: torque without friction, if torque is limited.
        friction: dq to the friction torque.

    Returns:
        The new motion, uniform at the period; None where no slower uniform timing keeps the limits.
    """
    curve = hermite_curve(motion)
    length = float(curve.x[-1])

    def torque(other: Motion) -> Array | None:
        if inverse_dynamics is None:
            return None
        rigid = inverse_dynamics(other.q, other.dq, other.ddq)
        return rigid if friction is None else rigid + friction(other.dq)

    factor = _uniform_factor(curve, motion, limits, torque)
    if factor is None:
        return None
    points = max(int(np.ceil(length / (period * factor))), 6)
    # Controller periods to an interval of the speed's spline, about: a phase of jerk lasts many times as long.
    grid = SpeedGrid(length=length, intervals=max(points // 3, 2))
    problem = TimingProblem(curve, grid, points, limits, inverse_dynamics, friction)
    best, weight = np.full(grid.size, factor**2), 1.0
    result: Motion | None = None
    for _ in range(5):
        start = _interior(problem, best)
        if start is None:
            break
        best = shorten(problem, start, first_weight=weight)
        law, weight = SpeedLaw(grid=grid, coefficients=best), 200.0
        shorter = _sampled(curve, law, limits, period, torque)
        if shorter is not None and (result is None or shorter.duration < result.duration):
            result = shorter
        if not _tighten(problem, curve, law, limits, period, torque):
            break
    return result


def _uniform_factor(curve: PPoly, motion: Motion, limits: Limits, torque: Torque) -> float | None:
    """The speed-up, at most 1e3 and at least 1e-3, at which the motion's own samples come to a limit."""
    usage = limit_usage(motion, limits, None)
    factor = min(float(np.min(np.maximum(usage[name], 1e-9) ** (-1.0 / ORDERS[name]))) for name in usage)
    factor = min(factor, 1e3)
    for _ in range(80):
        if factor < 1e-3:
            return None
        tau = torque(Motion(motion.t / factor, motion.q, motion.dq * factor, motion.ddq * factor**2))
        if tau is None or np.all(np.abs(tau) <= limits.torque):
            return factor
        factor *= 0.9
    return None


def _interior(problem: TimingProblem, coefficients: Array) -> Array | None:
    """The timing, slowed uniformly until it lies strictly within the limits."""
    for slower in (0.01, 0.02, 0.04, 0.08, 0.15, 0.3, 0.5, 0.7, 0.9, 0.97):
        if inside(problem, coefficients * (1.0 - slower)):
            return coefficients * (1.0 - slower)
    return None


def _run(curve: PPoly, law: SpeedLaw, count: int, period: float) -> tuple[Motion, Array]:
    """The motion in `count` periods, and its path positions (count + 1,)."""
    natural = float(law.knots[1][-1])
    t = period * np.arange(count + 1, dtype=np.float64)
    s, ds, dds = law.sample(t, count * period / natural)
    slope, bend = curve(s, 1), curve(s, 2)
    motion = Motion(t, curve(s), slope * ds[:, None], bend * ds[:, None] ** 2 + slope * dds[:, None])
    return motion, s


def _sampled(curve: PPoly, law: SpeedLaw, limits: Limits, period: float, torque: Torque) -> Motion | None:
    """The motion at the controller's period, stretched until its own samples keep every limit."""
    count = _count(law, period)
    for _ in range(40):
        motion, _ = _run(curve, law, count, period)
        usage = limit_usage(motion, limits, torque(motion))
        factor = max(float(usage[name].max()) ** (1.0 / ORDERS[name]) for name in usage)
        if factor <= 1.0:
            return motion
        count = max(count + 1, int(np.ceil(count * min(factor, 2.0))))
    return None


def _tighten(
    problem: TimingProblem, curve: PPoly, law: SpeedLaw, limits: Limits, period: float, torque: Torque
) -> bool:
    """Lowers limits around the samples that pass them; whether any did noticeably."""
    motion, s = _run(curve, law, _count(law, period), period)
    _, jerk = finite_jerk(motion)
    jerk = np.maximum(np.vstack([np.abs(jerk), np.zeros(motion.n)]), np.vstack([np.zeros(motion.n), np.abs(jerk)]))
    parts = [np.abs(motion.ddq) / limits.acceleration, (jerk / limits.jerk)[:, np.isfinite(limits.jerk)]]
    if problem.torque is not None:
        tau = torque(motion)
        assert tau is not None
        parts.append((np.abs(tau) / limits.torque)[:, problem.limited])
    excess = np.hstack(parts)
    share = np.ones_like(problem.allowed)
    # Use of a limit above which it is tightened; stretching corrects the rest.
    for row, column in np.argwhere(excess > 1.0005):
        low, high = s[max(row - 1, 0)], s[min(row + 1, len(s) - 1)]
        near = slice(*np.searchsorted(problem.s, [low - problem.width, high + problem.width]))
        share[near, column] = np.minimum(share[near, column], 0.998 / excess[row, column])
    problem.allowed = np.maximum(problem.allowed * share, 0.3)
    return bool(np.any(share < 1.0))


def _count(law: SpeedLaw, period: float) -> int:
    return max(int(np.ceil(float(law.knots[1][-1]) / period - 1e-9)), 1)


def hermite_curve(motion: Motion) -> PPoly:
    """Lays polynomials of fifth order through all samples: position, velocity and acceleration are met exactly.

    Args:
        motion: N >= 2 samples of n joints.

    Returns:
        q(s), s = t - t[0] from 0 to the duration, with n columns and continuous second derivatives.
    """
    h = np.diff(motion.t)[:, None]
    q, dq, ddq = motion.q, motion.dq, motion.ddq
    c0, c1, c2 = q[:-1], dq[:-1], ddq[:-1] / 2
    # The remainder of the first three terms at the end of each step.
    rest = (q[1:] - (c0 + h * (c1 + h * c2))) / h**3
    slope = (dq[1:] - (c1 + 2 * h * c2)) / h**2
    bend = (ddq[1:] - 2 * c2) / h
    c3 = 10 * rest - 4 * slope + bend / 2
    c4 = (-15 * rest + 7 * slope - bend) / h
    c5 = (6 * rest - 3 * slope + bend / 2) / h**2
    return PPoly(np.stack([c5, c4, c3, c2, c1, c0]), motion.t - motion.t[0])

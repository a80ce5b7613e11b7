"""Jerk-limited moves from one pose to another, planned by ruckig on this machine.

Ruckig posts intermediate waypoints to a web service and ignores position limits. Here it gets a start and an end and
nothing else, and what it returns is checked against the positions.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import ruckig
from numpy.typing import ArrayLike

from oed.retiming.limits import finite_limits, limit_usage, require_inside
from robots.common.arrays import Array
from robots.common.errors import InfeasibleError, InputError, SolverError
from robots.limits import Limits
from robots.signals import Motion

STANDSTILL = 1e-10
"""Distance below which two poses are one [rad], a hundred-thousandth of a fine encoder's step."""

FOLLOWER = 1e-6
"""Fraction of the longest stretch below which a joint gets that joint's profile instead of one of its own."""

SLOWED = 8
"""How often the top speed is lowered for a velocity limit that falls towards the end of a joint."""


@dataclass(frozen=True, kw_only=True, eq=False)
class PlannedMove:
    """A move as cubic pieces; on piece k, q_i(t) = sum_d coefficients[k, i, d] (t - breakpoints[k])^d.

    Args:
        breakpoints: (K+1,) [s], from 0 to the duration.
        coefficients: (K, n, 4) [rad/s^d].
    """

    breakpoints: Array
    coefficients: Array

    @property
    def n(self) -> int:
        """Number of joints."""
        return self.coefficients.shape[1]

    @property
    def duration(self) -> float:
        """Duration in s."""
        return float(self.breakpoints[-1])

    def sample(self, t: ArrayLike) -> tuple[Array, Array, Array]:
        """Evaluates the move.

        Args:
            t: times, (N,) [s], within the duration.

        Returns:
            Position, velocity and acceleration, (N, n) each.
        """
        times = np.clip(np.asarray(t, dtype=np.float64), 0.0, self.duration)
        piece = np.clip(np.searchsorted(self.breakpoints, times, side="right") - 1, 0, len(self.coefficients) - 1)
        s = (times - self.breakpoints[piece])[:, None]
        c0, c1, c2, c3 = np.moveaxis(self.coefficients[piece], -1, 0)
        return c0 + s * (c1 + s * (c2 + s * c3)), c1 + s * (2 * c2 + s * 3 * c3), 2 * c2 + 6 * s * c3


def plan_move(
    limits: Limits,
    start: ArrayLike,
    end: ArrayLike,
    *,
    period: float,
    minimum_duration: float = 0.0,
    straight: bool = False,
) -> PlannedMove | None:
    """Plans the fastest move from rest to rest under velocity, acceleration and jerk limits.

    All joints end together. The duration is rounded up to a multiple of the controller's period. Limits that are
    infinite are replaced by those of `finite_limits`.

    Args:
        limits: bounds of all joints.
        start: first pose, (n,) [rad].
        end: last pose, (n,) [rad].
        period: the controller's period [s].
        minimum_duration: the move lasts at least as long [s].
        straight: whether all joints follow one profile, so that the path is a straight line in joint space.

    Returns:
        The move; None where the poses are the same and no duration is asked for.

    Raises:
        InputError: poses of another size or that are not finite, or a period that is not positive.
        InfeasibleError: a limit of zero, or a pose outside the position limits, or where the joint may hardly move.
        SolverError: ruckig found no profile.
    """
    first, last = (np.asarray(pose, dtype=np.float64) for pose in (start, end))
    if first.shape != limits.lower.shape or last.shape != limits.lower.shape:
        raise InputError(f"found poses of shapes {first.shape} and {last.shape}", allowed=f"{limits.lower.shape}")
    if not np.all(np.isfinite(first + last)):
        raise InputError("a pose holds a number that is not finite")
    if not (np.isfinite(period) and period > 0.0):
        raise InputError(f"found the sample period {period} s", allowed="a positive number")
    require_inside(np.stack([first, last]), limits)
    stretch = last - first
    if np.all(np.abs(stretch) <= STANDSTILL):
        if minimum_duration <= 0.0:
            return None
        coefficients = np.zeros((1, first.size, 4))
        coefficients[0, :, 0] = first
        return PlannedMove(breakpoints=np.array([0.0, _rounded(minimum_duration, period)]), coefficients=coefficients)
    usable = finite_limits(limits)
    bounds = np.stack([usable.velocity, usable.acceleration, usable.jerk])  # (3, n)
    for _ in range(SLOWED):
        move = _between(first, stretch, bounds, period, minimum_duration, straight)
        _check_between(move, first, last)
        t = period * np.arange(round(move.duration / period) + 1, dtype=np.float64)
        motion = Motion(t, *move.sample(t))
        used = limit_usage(motion, limits)["velocity"]
        if limits.ramp is None or used.max() <= 1.0 + 1e-9:
            return move
        # Where the limit falls towards an end, a lower top speed shortens the way on which the joint brakes.
        slower = 0.98 * np.abs(motion.dq).max(axis=0) / np.minimum(used, 2.0)
        bounds[0] = np.where(used > 1.0, np.minimum(bounds[0], slower), bounds[0])
    joint = int(np.argmax(used))
    raise InfeasibleError(
        "an end of the move is where the joint may hardly move",
        joint=joint + 1,
        remedy="choose a pose farther from the end of the joint",
    )


def _between(
    first: Array, stretch: Array, bounds: Array, period: float, minimum_duration: float, straight: bool
) -> PlannedMove:
    """The move from a pose (n,) by a stretch (n,) under bounds of velocity, acceleration and jerk (3, n)."""
    if straight:
        moving = np.abs(stretch) > STANDSTILL
        shared = (bounds[:, moving] / np.abs(stretch[moving])).min(axis=1)
        breakpoints, profile = _profile(shared[:, None], np.ones(1), period, minimum_duration)
        coefficients = profile * stretch[:, None]
    else:
        breakpoints, coefficients = _profile(bounds, stretch, period, minimum_duration)
    coefficients[:, :, 0] += first
    return PlannedMove(breakpoints=breakpoints, coefficients=coefficients)


def _profile(bounds: Array, stretch: Array, period: float, minimum_duration: float) -> tuple[Array, Array]:
    """Breakpoints (K+1,) and pieces (K, n, 4) of the move from zero to `stretch`, (n,), under `bounds`, (3, n)."""
    n = stretch.size
    problem = ruckig.InputParameter(n)
    problem.current_position = [0.0] * n
    problem.target_position = stretch.tolist()
    problem.max_velocity, problem.max_acceleration, problem.max_jerk = bounds.tolist()
    planner, plan = ruckig.Ruckig(n), ruckig.Trajectory(n)
    _solve(planner, problem, plan)
    duration = _rounded(max(plan.duration, minimum_duration), period)
    problem.minimum_duration = duration
    _solve(planner, problem, plan)
    (profiles,) = plan.profiles
    knots = [np.concatenate([[0.0], np.cumsum(profile.t)]) for profile in profiles]
    inner = np.unique(np.concatenate(knots))
    # Knots of several joints that differ by rounding only are one.
    inner = inner[(inner > 1e-12) & (inner < duration - 1e-12)]
    inner = inner[np.diff(inner, prepend=-1.0) > 1e-12]
    breakpoints = np.concatenate([[0.0], inner, [duration]])
    shapes = [_shape(profile, times, breakpoints) for profile, times in zip(profiles, knots, strict=True)]
    leader = int(np.abs(stretch).argmax())
    met = np.array([abs(p.p[-1] - s) <= FOLLOWER * abs(s) for p, s in zip(profiles, stretch, strict=True)])
    if not met[leader]:
        raise SolverError(f"ruckig misses the target by {profiles[leader].p[-1] - stretch[leader]:.3g} rad or m")
    # Ruckig is not reliable for strokes of the size of its own tolerances.
    met &= np.abs(stretch) > FOLLOWER * abs(stretch[leader])
    sources = np.where(met, np.arange(n), leader)
    # The division makes exact what ruckig meets to some 1e-12.
    scaled = [shapes[source] * (stretch[joint] / profiles[source].p[-1]) for joint, source in enumerate(sources)]
    return breakpoints, np.stack(scaled, axis=1)


def _shape(profile: Any, times: Array, breakpoints: Array) -> Array:
    """One joint's profile of seven constant jerks, cut at the breakpoints of all joints, (K, 4)."""
    middles = (breakpoints[:-1] + breakpoints[1:]) / 2.0
    index = np.clip(np.searchsorted(times, middles, side="right") - 1, 0, 6)
    s = breakpoints[:-1] - times[index]
    p, v, a = (np.array(values)[index] for values in (profile.p, profile.v, profile.a))
    j = np.array(profile.j)[index]
    return np.stack([p + s * (v + s * (a / 2 + s * j / 6)), v + s * (a + s * j / 2), (a + s * j) / 2, j / 6], axis=-1)


def _solve(planner: ruckig.Ruckig, problem: ruckig.InputParameter, plan: ruckig.Trajectory) -> None:
    try:
        result = planner.calculate(problem, plan)
    except RuntimeError as error:
        raise SolverError(f"ruckig rejected a move: {error}") from error
    if result not in (ruckig.Result.Working, ruckig.Result.Finished):
        raise SolverError(f"ruckig found no move: {result}")


def _rounded(duration: float, period: float) -> float:
    return float(max(np.ceil(duration / period - 1e-9), 1.0) * period)


def _check_between(move: PlannedMove, first: Array, last: Array) -> None:
    """Every joint must stay between its two ends: that is what replaces the position limits which ruckig ignores."""
    c1, c2, c3 = np.moveaxis(move.coefficients[:, :, 1:], -1, 0)
    span = np.diff(move.breakpoints)[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        root = np.sqrt(np.maximum(c2**2 - 3.0 * c1 * c3, 0.0))
        turns = np.stack([(-c2 + root) / (3.0 * c3), (-c2 - root) / (3.0 * c3), -c1 / (2.0 * c2)])
    inside = np.isfinite(turns) & (turns >= 0.0) & (turns <= span)
    s = np.concatenate([np.where(inside, turns, 0.0), np.broadcast_to(span, c1.shape)[None]])
    c0 = move.coefficients[:, :, 0]
    q = c0 + s * (c1 + s * (c2 + s * c3))  # (4, K, n)
    tolerance = 1e-9 * np.maximum(1.0, np.abs(last - first))
    overshoot = np.maximum(np.minimum(first, last) - q.min(axis=(0, 1)), q.max(axis=(0, 1)) - np.maximum(first, last))
    if np.any(overshoot > tolerance):
        joint = int(np.argmax(overshoot))
        raise SolverError(f"the planned move overshoots its ends by {overshoot[joint]:.3g} rad or m", joint=joint + 1)

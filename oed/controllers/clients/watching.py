"""The path is watched while it is played: feedback that leaves the plan ends the motion."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import deque

import numpy as np

from oed.controllers.errors import ControllerError
from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.robot import Robot
from robots.signals import Motion

USUAL_ANGLE_TOLERANCE = 0.05
"""Usual tolerance of a joint that turns [rad]."""

PLAN_STEP = 0.005
"""Between two lags that are compared, and between two samples of the plan [s]."""

LARGEST_LAG = 0.1
"""A joint lags behind the first movement, or leads it, by no more than this [s]: drives follow later, clocks jitter."""

CLOCK_DRIFT = 5e-4
"""The clocks of plan and controller differ by no more than this share."""

SPEED_SPAN = 0.05
"""Time over which the robot's speed is measured [s]."""


def tolerances(robot: Robot, given: float | tuple[float, ...] | None) -> Array:
    """Gives the tolerance of each joint (n,) [rad or m].

    Args:
        robot: the robot.
        given: one for all joints, or one each; infinity for a joint that is not watched. The usual ones by default.

    Raises:
        InputError: another number of values.
    """
    if given is None:
        # A joint that slides has 0.02 m.
        return np.array([0.02 if joint.kind == "prismatic" else USUAL_ANGLE_TOLERANCE for joint in robot.chain.joints])
    values = np.atleast_1d(np.asarray(given, dtype=float))
    if values.size not in (1, robot.n):
        raise InputError(f"{values.size} tolerances", allowed=f"one, or {robot.n}, as {robot.name} has joints")
    return np.broadcast_to(values, (robot.n,)).copy()


class Watch(ABC):
    """Compares feedback with the plan.

    Args:
        motion: the plan.
        tolerance: of each joint (n,) [rad or m].
        unit: of each joint.
    """

    def __init__(self, motion: Motion, tolerance: Array, unit: list[str]) -> None:
        self._tolerance, self._unit = tolerance, unit
        count = max(int(np.ceil(motion.duration / PLAN_STEP)), 1) + 1
        times = motion.t[0] + PLAN_STEP * np.arange(count)
        self._plan = np.column_stack([np.interp(times, motion.t, motion.q[:, j]) for j in range(motion.n)])
        self._since = np.full(motion.n, np.inf)

    @abstractmethod
    def _nearest(self, s: float, q: Array) -> tuple[Array, Array] | None:
        """Gives where the plan wants each joint (n,), and its time (n,) [s]; None while it is not known."""

    def see(self, s: float, q: Array) -> None:
        """Takes a row of feedback.

        Args:
            s: its time on the clock of the feedback [s].
            q: positions (n,) [rad or m].

        Raises:
            ControllerError: the robot has left the plan.
        """
        found = self._nearest(s, q)
        if found is None:
            return
        wanted, times = found
        away = np.abs(q - wanted)
        beyond = away > self._tolerance
        # A distance beyond the tolerance counts once it lasts [s]: a message that came late shows an old position.
        lasting = beyond & (s - self._since >= 0.05)
        self._since = np.where(beyond, np.minimum(self._since, s), np.inf)
        if not lasting.any():
            return
        joint = int(np.where(lasting, away / self._tolerance, 0.0).argmax())
        raise ControllerError(
            f"the robot has left the plan: at {times[joint]:.2f} s of the trajectory it is at {q[joint]:.4g} "
            f"{self._unit[joint]}, the plan is {wanted[joint]:.4g} {self._unit[joint]}",
            joint=joint + 1,
            allowed=f"a distance up to {self._tolerance[joint]:g} {self._unit[joint]} (--tolerance)",
            remedy=self._remedy,
        )

    _remedy = "check order, signs and zeros of the joints at the controller, and whether it plays this robot"


class TimedWatch(Watch):
    """Watches a controller that plays in time: each joint follows the plan after one lag, which is measured.

    The first movement gives the lag of the start. Around it each joint has the lag that fits its last seconds best.

    Args:
        motion: the plan.
        tolerance: of each joint (n,) [rad or m].
        unit: of each joint.
        rate: seconds of the plan in a second of the feedback's clock.
    """

    _remedy = Watch._remedy + ", at the speed of the trajectory"

    def __init__(self, motion: Motion, tolerance: Array, unit: list[str], rate: float = 1.0) -> None:
        super().__init__(motion, tolerance, unit)
        self._rate = rate
        self._onset = _Onset(tolerance)
        planned = _Onset(tolerance, np.zeros(motion.n))
        planned.see(-SPEED_SPAN, self._plan[0])
        starts = (planned.see(PLAN_STEP * k, q) for k, q in enumerate(self._plan))
        self._begins = next((start for start in starts if start is not None), None)
        self._duration = motion.duration
        self._reach = LARGEST_LAG
        self._lags: Array = np.zeros(1)
        self._misfit: Array = np.zeros((1, motion.n))
        self._zero: float | None = None
        self._last = 0.0

    def _begin(self, zero: float, s: float) -> None:
        """Begins at the time (zero) at which the plan begins on the feedback's clock [s]."""
        self._zero, self._last = zero, s
        # The first movement is seen late by a message or two.
        self._reach = LARGEST_LAG + 2 * self._onset.step
        count = int(np.ceil((self._reach + CLOCK_DRIFT * self._duration) / PLAN_STEP))
        self._lags = PLAN_STEP * np.arange(-count, count + 1, dtype=np.float64)
        # Lags that fit equally well, as of a joint that stands: the one of the start counts.
        self._misfit = np.outer(1e-6 * self._lags**2, np.ones(self._plan.shape[1]))

    def _nearest(self, s: float, q: Array) -> tuple[Array, Array] | None:
        s *= self._rate
        if self._zero is None:
            start = None if self._begins is None else self._onset.see(s, q)
            if start is None:
                return None
            assert self._begins is not None
            self._begin(start - self._begins, s)
        assert self._zero is not None
        now = s - self._zero
        times = now - self._lags
        places = np.clip(times / PLAN_STEP, 0, len(self._plan) - 1)
        left = np.minimum(places.astype(int), len(self._plan) - 2)
        share = (places - left)[:, None]
        plan = (1 - share) * self._plan[left] + share * self._plan[left + 1]
        # The lag is that of the last seconds [s].
        self._misfit *= np.exp((self._last - s) / 10.0)
        self._last = s
        # A message that came late counts no more than one at the edge.
        self._misfit += np.minimum(np.abs(q - plan), self._tolerance / 5) ** 2
        best = np.where(np.abs(self._lags)[:, None] <= self._reach + CLOCK_DRIFT * now, self._misfit, np.inf).argmin(
            axis=0
        )
        joints = np.arange(len(q))
        return plan[best, joints], times[best]


class PathWatch(Watch):
    """Watches a controller that plays in its own time: the robot must be near some point that comes next.

    Args:
        motion: the plan.
        tolerance: of each joint (n,) [rad or m].
        unit: of each joint.
    """

    BACK, AHEAD = 0.5, 5.0
    """How far before and behind the point that was reached the next one is looked for [s of the plan]."""

    CLOSE = 0.2
    """Of points that are as near up to this share of the tolerance, the first counts: a path may come back."""

    def __init__(self, motion: Motion, tolerance: Array, unit: list[str]) -> None:
        super().__init__(motion, tolerance, unit)
        # A controller without time knows no rest between points.
        moves = np.append(True, np.abs(np.diff(self._plan, axis=0)).max(axis=1) > 1e-6)
        self._times, self._plan = PLAN_STEP * np.flatnonzero(moves), self._plan[moves]
        self._reached = 0

    def _nearest(self, s: float, q: Array) -> tuple[Array, Array] | None:
        first = max(0, self._reached - int(self.BACK / PLAN_STEP))
        piece = self._plan[first : self._reached + int(self.AHEAD / PLAN_STEP)]
        away = (np.abs(piece - q) / self._tolerance).max(axis=1)
        nearest = first + int((away <= away.min() + self.CLOSE).argmax())
        self._reached = max(self._reached, nearest)
        return self._plan[nearest], np.full(len(q), self._times[nearest])


class _Onset:
    """Finds when a movement began that went on until the robot was away from its start.

    What ends before, as a joint that sags when brakes open, is none.
    """

    def __init__(self, tolerance: Array, noise: Array | None = None) -> None:
        # Share of the tolerance that a movement must reach, so that it is no sag or noise.
        self._far = 0.2 * np.where(np.isfinite(tolerance), tolerance, USUAL_ANGLE_TOLERANCE)
        self._recent: deque[tuple[float, Array]] = deque()
        self._noise = noise
        self._rest: Array | None = None
        self._begun: float | None = None

    @property
    def step(self) -> float:
        """Time between two of the last rows [s]."""
        return (self._recent[-1][0] - self._recent[0][0]) / max(len(self._recent) - 1, 1)

    def see(self, s: float, q: Array) -> float | None:
        """Takes positions (n,) at a time [s]; gives the time of the onset once it is known."""
        recent = self._recent
        recent.append((s, q))
        while len(recent) > 2 and recent[1][0] <= s - SPEED_SPAN:
            recent.popleft()
        span = s - recent[0][0]
        spread = np.ptp(np.array([pose for _, pose in recent]), axis=0)
        if self._rest is None:
            self._rest = q
        if self._noise is None:
            # The robot stands before the first point is sent.
            if span >= SPEED_SPAN:
                self._noise = spread
            return None
        # The robot moves if it is faster than 0.004 rad/s or m/s.
        allowed = np.minimum(np.maximum(0.004 * max(span, SPEED_SPAN), 3 * self._noise), self._far / 2)
        if (spread <= allowed).all():
            self._begun, self._rest = None, q
            return None
        if self._begun is None:
            self._begun = s
        return self._begun if (np.abs(q - self._rest) > self._far).any() else None


def watch_of(
    motion: Motion, robot: Robot, given: float | tuple[float, ...] | None, timed: bool, rate: float
) -> Watch | None:
    """Makes the watch of a motion; None where no joint is watched.

    Args:
        motion: the plan.
        robot: the robot.
        given: see `tolerances`.
        timed: whether the controller plays in time.
        rate: see `TimedWatch`.
    """
    tolerance = tolerances(robot, given)
    if not np.isfinite(tolerance).any():
        return None
    unit = [robot.limits.unit(joint) for joint in range(robot.n)]
    return TimedWatch(motion, tolerance, unit, rate) if timed else PathWatch(motion, tolerance, unit)

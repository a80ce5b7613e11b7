"""Friction sweeps: one joint back and forth at constant speeds, between jerk-limited ramps (thesis section 2.4)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from oed.trajectories.base import Array, Kinematics, Trajectory, frozen
from oed.trajectories.polynomial import PiecewisePolynomial
from oed.trajectories.ramps import (
    JointBounds,
    Profile,
    checked_pose,
    fill,
    joined,
    joint_bounds,
    stroke,
    whole_periods,
)
from oed.trajectories.stage_defaults import FRICTION_LEVELS, LONGEST_PLATEAU
from robots.common.errors import InputError
from robots.limits import Limits

SHORTEST_PLATEAU = 0.1
"""Time at constant speed that every level gets [s], 25 samples at 4 ms; in too short a range, speed gives way."""


@dataclass(frozen=True, kw_only=True)
class Plateau:
    """A stretch of constant speed.

    Args:
        joint: the joint that moves, counted from 1.
        asked: speed that was asked for [rad/s].
        speed: speed driven [rad/s], above zero; below `asked` where the range is too short to reach that.
        direction: 1 or -1.
        start: when it starts [s].
        end: when it ends [s].
        shortened: whether the range cost it time or speed.
    """

    joint: int
    asked: float
    speed: float
    direction: int
    start: float
    end: float
    shortened: bool

    @property
    def duration(self) -> float:
        """Time at constant speed [s]."""
        return self.end - self.start


@dataclass(frozen=True, kw_only=True, eq=False)
class Sweep(Trajectory):
    """One joint moves, the others hold a pose.

    Args:
        pose: of all joints, (n,) [rad]; that of the moving joint does not count.
        joint: the joint that moves, counted from 1.
        path: its motion, a trajectory of one joint.
        plateaus: its stretches of constant speed, in order.

    Raises:
        InputError: the joint does not exist, or the path is not of one joint.
    """

    pose: Array
    joint: int
    path: PiecewisePolynomial
    plateaus: tuple[Plateau, ...]

    def __post_init__(self) -> None:
        object.__setattr__(self, "pose", frozen(self.pose, "pose", 1))
        object.__setattr__(self, "plateaus", tuple(self.plateaus))
        if not 1 <= self.joint <= self.pose.size:
            raise InputError("the joint does not exist", joint=self.joint, allowed=f"1 to {self.pose.size}")
        if self.path.n != 1:
            raise InputError(f"found a path of {self.path.n} joints", allowed="that of one joint")

    @property
    def n(self) -> int:
        """Number of joints."""
        return self.pose.size

    @property
    def duration(self) -> float:
        """Duration in s."""
        return self.path.duration

    def sample(self, t: ArrayLike) -> Kinematics:
        """Evaluates the sweep; a time outside the duration takes the value at the nearer end.

        Args:
            t: times, (N,) [s].

        Returns:
            Position, velocity, acceleration and jerk, each (N, n); where the jerk jumps, that of the later piece.
        """
        moving = self.path.sample(t)
        q = np.tile(self.pose, (moving.q.shape[0], 1))
        whole = Kinematics(q, *np.zeros((3, *q.shape)))
        for values, column in zip(whole, moving, strict=True):
            values[:, self.joint - 1] = column[:, 0]
        return whole


def friction_sweep(
    limits: Limits,
    joint: int,
    pose: ArrayLike,
    *,
    period: float,
    levels: Sequence[float] = FRICTION_LEVELS,
    plateau: float | None = None,
    pause: float = 0.0,
) -> Sweep:
    """Drives one joint at each level of its speed, up and down, for equal times (thesis eq. 84).

    Travel grows with speed and is centred on the pose, shifted where the range ends. Between levels of different travel
    the joint moves to where the next begins. Where the range is too short for the time at a level, the time shortens,
    down to `SHORTEST_PLATEAU`; if it is too short even for that, the speed is reduced. See the plateaus.

    Args:
        limits: bounds of all joints.
        joint: the joint that moves, counted from 1.
        pose: (n,) [rad]: where the other joints hold, and the centre of travel; see `vertical_axis_pose`.
        period: the controller's period [s].
        levels: speeds as fractions of the velocity limit, above 0 and up to 1.
        plateau: time at constant speed [s]; by default the same at all levels, the longest that all can have, up to
            `LONGEST_PLATEAU`.
        pause: rest at each turn [s].

    Returns:
        The sweep, at rest at both ends, each stroke starting on a controller period.

    Raises:
        InputError: no such joint, a pose outside, levels, times or a period out of range, or a limit that is missing.
        InfeasibleError: a limit of zero.
    """
    bounds, centre = joint_bounds(limits, joint), checked_pose(limits, pose)
    fractions = np.asarray(levels, dtype=np.float64)
    if fractions.ndim != 1 or fractions.size == 0 or not np.all((fractions > 0.0) & (fractions <= 1.0)):
        raise InputError(f"found the levels {levels}", joint=joint, allowed="fractions above 0 and up to 1")
    if plateau is not None and not (np.isfinite(plateau) and plateau > 0.0):
        raise InputError(f"found {plateau} s at constant speed", joint=joint, allowed="a positive time")
    speeds = fractions * bounds.velocity
    span = bounds.upper - bounds.lower
    fitting = [(span - 2.0 * bounds.ramp_distance(speed)) / speed for speed in speeds]
    wanted = min(LONGEST_PLATEAU, max(SHORTEST_PLATEAU, min(fitting))) if plateau is None else plateau
    travels = []
    for asked, room in zip(speeds, fitting, strict=True):
        least = min(SHORTEST_PLATEAU, wanted)
        # Half a nanosecond of rounding is no shortage.
        speed = asked if room >= least - 1e-9 else min(asked, bounds.highest_speed(span, least))
        time = max(min(wanted, (span - 2.0 * bounds.ramp_distance(speed)) / speed), 0.0)
        distance = min(2.0 * bounds.ramp_distance(speed) + speed * time, span)
        lowest = float(np.clip(centre[joint - 1] - distance / 2.0, bounds.lower, bounds.upper - distance))
        shortened = bool(speed < asked or time < wanted - 1e-9)
        travels.append(Travel(asked=asked, speed=speed, lower=lowest, upper=lowest + distance, shortened=shortened))
    return sweep_over(bounds, joint, centre, travels, period=period, pause=pause)


@dataclass(frozen=True, kw_only=True)
class Travel:
    """One stroke up and one down.

    Args:
        asked: speed that was asked for [rad/s].
        speed: speed to drive [rad/s]; the travel must hold its ramps.
        lower: where it starts and ends [rad].
        upper: where it turns [rad].
        shortened: whether the range cost it time or speed.
    """

    asked: float
    speed: float
    lower: float
    upper: float
    shortened: bool


def sweep_over(
    bounds: JointBounds, joint: int, pose: Array, travels: Sequence[Travel], *, period: float, pause: float = 0.0
) -> Sweep:
    """Strings strokes up and down together.

    Args:
        bounds: of the joint.
        joint: counted from 1.
        pose: (n,) [rad].
        travels: in order.
        period: the controller's period [s].
        pause: rest at each turn [s].

    Returns:
        The sweep; each stroke starts on a controller period.

    Raises:
        InputError: a pause or a period out of range.
    """
    if not (np.isfinite(pause) and pause >= 0.0):
        raise InputError(f"found a pause of {pause} s", joint=joint, allowed="zero or more")
    count, here = 0, travels[0].lower
    parts: list[tuple[float, Profile]] = []
    plateaus: list[Plateau] = []

    def append(profile: Profile) -> None:
        nonlocal count
        periods = whole_periods(profile.duration + pause, period)
        parts.append((count * period, fill(profile, periods * period)))
        count += periods

    for travel in travels:
        gap = abs(travel.lower - here)
        # Distance below which two positions are one [rad].
        if gap > 1e-12:
            append(stroke(bounds, here, travel.lower, bounds.highest_speed(gap))[0])
        for start, end in ((travel.lower, travel.upper), (travel.upper, travel.lower)):
            profile, begins, ends = stroke(bounds, start, end, travel.speed)
            plateaus.append(
                Plateau(
                    joint=joint,
                    asked=float(travel.asked),
                    speed=float(travel.speed),
                    direction=1 if end > start else -1,
                    start=float(count * period + begins),
                    end=float(count * period + ends),
                    shortened=travel.shortened,
                )
            )
            append(profile)
        here = travel.lower
    return Sweep(pose=pose, joint=joint, path=joined(parts, count * period), plateaus=tuple(plateaus))

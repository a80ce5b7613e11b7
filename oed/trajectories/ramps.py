"""Jerk-limited strokes of one joint: S-curve ramps about a stretch of constant speed."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from oed.trajectories.base import WHOLE_PERIOD_TOLERANCE, Array, frozen
from oed.trajectories.polynomial import PiecewisePolynomial
from robots.common.errors import InfeasibleError, InputError
from robots.limits import Limits


@dataclass(frozen=True, kw_only=True)
class JointBounds:
    """What one joint may do, a hair inside its limits.

    A ramp from rest to the speed v takes v/a + a/j, or 2 sqrt(v/j) where the acceleration a is not reached, and half
    of that time's v in travel, for it is point-symmetric.

    Args:
        lower: lowest position [rad].
        upper: highest position [rad].
        velocity: highest speed [rad/s].
        acceleration: highest acceleration [rad/s^2].
        jerk: highest jerk [rad/s^3].
    """

    lower: float
    upper: float
    velocity: float
    acceleration: float
    jerk: float

    def ramp_times(self, speed: float) -> tuple[float, float]:
        """Times at constant jerk (twice) and at constant acceleration of the ramp to a speed [s]."""
        if speed * self.jerk <= self.acceleration**2:
            return float(np.sqrt(speed / self.jerk)), 0.0
        build_up = self.acceleration / self.jerk
        return build_up, speed / self.acceleration - build_up

    def ramp_distance(self, speed: float) -> float:
        """Travel of the ramp from rest to a speed [rad]."""
        build_up, steady = self.ramp_times(speed)
        return speed * (2.0 * build_up + steady) / 2.0

    def highest_speed(self, distance: float, plateau: float = 0.0) -> float:
        """The highest speed of a stroke from rest to rest.

        Args:
            distance: its travel [rad].
            plateau: the least time at that speed [s].

        Returns:
            The speed that the travel, or the velocity limit, allows [rad/s].
        """
        if 2.0 * self.ramp_distance(self.velocity) + self.velocity * plateau <= distance:
            return self.velocity
        low, high = 0.0, self.velocity
        # Bisection to the last bit from below: the travel is never passed.
        while low < (middle := (low + high) / 2.0) < high:
            if 2.0 * self.ramp_distance(middle) + middle * plateau <= distance:
                low = middle
            else:
                high = middle
        return low


@dataclass(frozen=True, kw_only=True, eq=False)
class Profile:
    """A motion of one joint in cubic pieces: q(s) = sum_d coefficients[k, d] s^d for 0 <= s <= durations[k].

    Args:
        durations: (K,) [s].
        coefficients: (K, 4) [rad/s^d].
    """

    durations: Array
    coefficients: Array

    @property
    def duration(self) -> float:
        """Duration in s."""
        return float(self.durations.sum())


def used_range(lower: float, upper: float, centre: float, fraction: float, joint: int) -> tuple[float, float]:
    """The part of a joint's range that a motion uses, about the middle.

    Args:
        lower: lowest position [rad].
        upper: highest position [rad].
        centre: about which a joint without limits on both sides turns [rad].
        fraction: of the range, above 0 and up to 1.
        joint: counted from 1, for the error message.

    Returns:
        Where it starts and where it turns [rad].

    Raises:
        InputError: a fraction out of range.
    """
    if not 0.0 < fraction <= 1.0:
        raise InputError(f"found {fraction} of the range", joint=joint, allowed="a fraction above 0 and up to 1")
    if not np.isfinite(upper - lower):
        # The whole range of a joint without position limits is one turn.
        half = np.pi
        # A limit on one side pushes the turn away from it.
        centre = float(np.clip(centre, lower + half, upper - half))
        lower, upper = centre - half, centre + half
    inset = (1.0 - fraction) * (upper - lower) / 2.0
    return lower + inset, upper - inset


def joint_bounds(limits: Limits, joint: int, *, reserve: float = 1e-9) -> JointBounds:
    """Takes one joint's limits, a hair inside.

    Args:
        limits: bounds of all joints.
        joint: counted from 1.
        reserve: the fraction left unused.

    Returns:
        The bounds.

    Raises:
        InputError: no such joint, or no finite velocity, acceleration or jerk limit.
        InfeasibleError: one of these is zero.
    """
    if not 1 <= joint <= limits.n:
        raise InputError("the joint does not exist", joint=joint, allowed=f"1 to {limits.n}")
    rates = {name: float(getattr(limits, name)[joint - 1]) for name in ("velocity", "acceleration", "jerk")}
    for name, value in rates.items():
        if not np.isfinite(value):
            raise InputError(
                f"has no {name} limit",
                joint=joint,
                remedy="state one under limits in a robot YAML, which may name a URDF or MJCF",
            )
        if value <= 0.0:
            raise InfeasibleError(
                f"its {name} limit is {value:g}: it cannot move", joint=joint, allowed=f"a {name} limit above zero"
            )
    lower, upper = float(limits.lower[joint - 1]), float(limits.upper[joint - 1])
    inset = reserve * (upper - lower) if np.isfinite(upper - lower) else 0.0
    kept = {name: (1.0 - reserve) * value for name, value in rates.items()}
    return JointBounds(lower=lower + inset, upper=upper - inset, **kept)


def stroke(bounds: JointBounds, start: float, end: float, speed: float) -> tuple[Profile, float, float]:
    """Moves from rest to rest by ramps as steep as the bounds allow, about a stretch of constant speed.

    Args:
        bounds: of the joint.
        start: first position [rad].
        end: last position [rad].
        speed: between the ramps [rad/s], at most `JointBounds.highest_speed` of the distance.

    Returns:
        The profile, and when the stretch of constant speed starts and ends [s].
    """
    distance, sign = abs(end - start), np.sign(end - start)
    build_up, steady = bounds.ramp_times(speed)
    peak = bounds.jerk * build_up
    ramp = bounds.ramp_distance(speed)
    plateau = max(distance - 2.0 * ramp, 0.0) / speed
    x1, v1 = peak * build_up**2 / 6.0, peak * build_up / 2.0
    x2, v2 = x1 + v1 * steady + peak * steady**2 / 2.0, v1 + peak * steady
    half, sixth = peak / 2.0, bounds.jerk / 6.0
    # The way down mirrors the way up, from the far end: no error piles up.
    pieces = np.array(
        [
            [0.0, 0.0, 0.0, sixth],
            [x1, v1, half, 0.0],
            [x2, v2, half, -sixth],
            [ramp, speed, 0.0, 0.0],
            [distance - ramp, speed, 0.0, -sixth],
            [distance - x2, v2, -half, 0.0],
            [distance - x1, v1, -half, sixth],
        ]
    )
    durations = np.array([build_up, steady, build_up, plateau, build_up, steady, build_up])
    coefficients = sign * pieces
    coefficients[:, 0] += start
    kept = durations > 0.0
    ramp_duration = 2.0 * build_up + steady
    return (
        Profile(durations=durations[kept], coefficients=coefficients[kept]),
        ramp_duration,
        ramp_duration + plateau,
    )


def rest(position: float, duration: float) -> Profile:
    """Stays at a position [rad] for a time [s]."""
    return Profile(durations=np.array([duration]), coefficients=np.array([[position, 0.0, 0.0, 0.0]]))


def fill(profile: Profile, duration: float) -> Profile:
    """Lets a profile rest where it ends until it has lasted a given time [s], no shorter than its own."""
    left = duration - profile.duration
    if left <= 1e-12:
        return profile
    last = float(np.polynomial.polynomial.polyval(profile.durations[-1], profile.coefficients[-1]))
    pause = rest(last, left)
    return Profile(
        durations=np.concatenate([profile.durations, pause.durations]),
        coefficients=np.vstack([profile.coefficients, pause.coefficients]),
    )


def joined(profiles: Iterable[tuple[float, Profile]], duration: float) -> PiecewisePolynomial:
    """Joins profiles, each with the time at which it starts, into a trajectory of one joint.

    Args:
        profiles: in order, each lasting until the next starts.
        duration: when the last ends [s].

    Returns:
        The trajectory; starts are kept exactly, so that rounding does not add up over many strokes.
    """
    parts = list(profiles)
    starts = [begin + np.concatenate([[0.0], np.cumsum(item.durations)[:-1]]) for begin, item in parts]
    breakpoints = np.concatenate([*starts, [duration]])
    coefficients = np.vstack([item.coefficients for _, item in parts])
    # A piece shorter than rounding has nothing to say.
    kept = np.diff(breakpoints) > 1e-12
    return PiecewisePolynomial(
        breakpoints=np.concatenate([[0.0], breakpoints[:-1][kept][1:], [duration]]),
        coefficients=coefficients[kept][:, None, :],
    )


def checked_pose(limits: Limits, pose: ArrayLike, name: str = "pose") -> Array:
    """Checks that a pose has as many joints as the limits and lies within them.

    Args:
        limits: bounds of all joints.
        pose: (n,) [rad].
        name: what to call it.

    Returns:
        The pose, read-only.

    Raises:
        InputError: another shape, a number that is not finite, or a joint outside its range.
    """
    array = frozen(pose, name, 1)
    if array.shape != limits.lower.shape:
        raise InputError(f"found a {name} of {array.size} joints", allowed=f"{limits.n}")
    outside = (array < limits.lower) | (array > limits.upper)
    if np.any(outside):
        joint = int(np.argmax(outside))
        raise InputError(
            f"the {name} {array[joint]:.6g} {limits.unit(joint)} lies outside",
            joint=joint + 1,
            allowed=f"{limits.lower[joint]:.6g} to {limits.upper[joint]:.6g}",
        )
    return array


def whole_periods(duration: float, period: float) -> int:
    """Counts the controller periods that a duration takes, begun ones included.

    Args:
        duration: [s].
        period: [s].

    Returns:
        The count.

    Raises:
        InputError: the period is not positive.
    """
    if not (np.isfinite(period) and period > 0.0):
        raise InputError(f"found the sample period {period} s", allowed="a positive number")
    return int(np.ceil(duration / period - 1e-3 * WHOLE_PERIOD_TOLERANCE))

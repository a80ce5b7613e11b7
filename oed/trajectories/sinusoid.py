"""One joint there and back on the sinusoidal acceleration profile, to reach its velocity bound both ways."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from oed.trajectories.base import Array, Kinematics, Trajectory, frozen, round_up
from robots.common.errors import InfeasibleError, InputError
from robots.limits import Limits


@dataclass(frozen=True, kw_only=True, eq=False)
class Sinusoid(Trajectory):
    """One joint moves from its start by `delta` and back, the others rest.

    Each way, with T the `stroke_duration` (thesis eq. 81 to 83)::

        q(t)   = q0 + delta (t/T - sin(2 pi t/T) / (2 pi))
        dq(t)  = delta/T (1 - cos(2 pi t/T))
        ddq(t) = 2 pi delta/T^2 sin(2 pi t/T)

    Velocity and acceleration are zero at the start, at the turn and at the end.

    Args:
        start: pose of all joints, (n,) [rad].
        joint: the joint that moves, counted from 1.
        delta: stroke [rad], of either sign.
        stroke_duration: time T of one way [s].

    Raises:
        InputError: the joint does not exist, or the duration is not positive.
    """

    start: Array
    joint: int
    delta: float
    stroke_duration: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "start", frozen(self.start, "start", 1))
        if not 1 <= self.joint <= self.start.size:
            raise InputError("the joint does not exist", joint=self.joint, allowed=f"1 to {self.start.size}")
        if not (np.isfinite(self.stroke_duration) and self.stroke_duration > 0 and np.isfinite(self.delta)):
            raise InputError(
                f"found a stroke of {self.delta} rad or m in {self.stroke_duration} s",
                joint=self.joint,
                allowed="a finite stroke in a positive time",
            )

    @property
    def n(self) -> int:
        """Number of joints."""
        return self.start.size

    @property
    def duration(self) -> float:
        """Duration of both ways in s."""
        return 2.0 * self.stroke_duration

    @property
    def peak_velocity(self) -> float:
        """Largest speed, 2 |delta| / T [rad/s]."""
        return 2.0 * abs(self.delta) / self.stroke_duration

    def sample(self, t: ArrayLike) -> Kinematics:
        """Evaluates both ways; a time outside the duration takes the value at the nearer end.

        Args:
            t: times, (N,) [s].

        Returns:
            Position, velocity, acceleration and jerk, each (N, n).
        """
        way = np.clip(np.asarray(t, dtype=np.float64) / self.stroke_duration, 0.0, 2.0)
        back = way > 1.0
        fraction = np.where(back, way - 1.0, way)
        delta = np.where(back, -self.delta, self.delta)
        rate = 1.0 / self.stroke_duration
        phase = 2.0 * np.pi * (fraction - np.rint(fraction))
        sine, cosine = np.sin(phase), np.cos(phase)
        column = self.joint - 1
        q = np.tile(self.start, (way.size, 1))
        dq, ddq, dddq = np.zeros((3, *q.shape))
        q[:, column] += np.where(back, self.delta, 0.0) + delta * (fraction - sine / (2.0 * np.pi))
        dq[:, column] = delta * rate * (1.0 - cosine)
        ddq[:, column] = 2.0 * np.pi * delta * rate**2 * sine
        dddq[:, column] = 4.0 * np.pi**2 * delta * rate**3 * cosine
        return Kinematics(q, dq, ddq, dddq)


def shortest_stroke_duration(limits: Limits, joint: int, delta: float, period: float) -> float:
    """The shortest time of one way that keeps the limits, rounded up to a multiple of the controller's period.

    2 |delta| / T <= velocity, 2 pi |delta| / T^2 <= acceleration, 4 pi^2 |delta| / T^3 <= jerk (the peaks of thesis
    eq. 82, 83 and of the derivative of eq. 83).

    Args:
        limits: bounds of all joints.
        joint: the joint that moves, counted from 1.
        delta: stroke [rad].
        period: the controller's period [s].

    Returns:
        T [s], at least one period.

    Raises:
        InfeasibleError: one of the bounds is zero.
    """
    velocity, acceleration, jerk = _bounds(limits, joint)
    stroke = abs(delta)
    duration = max(
        2.0 * stroke / velocity, np.sqrt(2.0 * np.pi * stroke / acceleration), np.cbrt(4.0 * np.pi**2 * stroke / jerk)
    )
    return max(round_up(duration, period), period)


def velocity_reaching_stroke(limits: Limits, joint: int, centre: ArrayLike, *, period: float) -> Sinusoid:
    """The shortest stroke by which one joint reaches its velocity bound both ways.

    The acceleration bound asks for delta >= pi v^2 / (2 a), the jerk bound for delta >= pi v^(3/2) / sqrt(2 j). The
    stroke is centred on the given pose where the position range allows it, else shifted. Where the range is too short,
    the whole range is used, at the speed that it gives (`Sinusoid.peak_velocity`).

    Args:
        limits: bounds of all joints.
        joint: the joint that moves, counted from 1.
        centre: pose about which it moves, (n,) [rad]; the other joints rest there.
        period: the controller's period [s].

    Returns:
        The motion. It starts at its own lower end, not at the centre.

    Raises:
        InfeasibleError: one of the joint's bounds is zero.
        InputError: no such joint, a pose outside the limits, or neither a velocity bound nor one of its derivatives.
    """
    pose = np.array(frozen(centre, "centre", 1))
    velocity, acceleration, jerk = _bounds(limits, joint)
    if not np.isfinite(velocity) or not (np.isfinite(acceleration) or np.isfinite(jerk)):
        raise InputError(
            f"found the velocity limit {velocity}, the acceleration limit {acceleration} and the jerk limit {jerk}",
            joint=joint,
            allowed="a finite velocity limit, and a finite acceleration or jerk limit",
            remedy="state them in the robot file",
        )
    lower, upper = limits.lower[joint - 1], limits.upper[joint - 1]
    if not lower <= pose[joint - 1] <= upper:
        found = f"the pose {pose[joint - 1]:.6g} {limits.unit(joint - 1)} lies outside"
        raise InputError(found, joint=joint, allowed=f"{lower} to {upper}")
    needed = max(np.pi * velocity**2 / (2.0 * acceleration), np.pi * velocity**1.5 / np.sqrt(2.0 * jerk))
    # The time is rounded first and the stroke follows, so that the velocity bound is met and not just approached.
    duration = max(round_up(2.0 * needed / velocity, period), period)
    delta = velocity * duration / 2.0
    if delta > upper - lower:
        delta = upper - lower
        duration = shortest_stroke_duration(limits, joint, delta, period)
    # The difference may round up and the sum past the limit: the last shift puts it back.
    pose[joint - 1] = min(max(pose[joint - 1] - delta / 2.0, lower), upper - delta)
    return Sinusoid(start=pose, joint=joint, delta=delta, stroke_duration=duration)


def _bounds(limits: Limits, joint: int) -> tuple[float, float, float]:
    count = limits.velocity.size
    if not 1 <= joint <= count:
        raise InputError("the joint does not exist", joint=joint, allowed=f"1 to {count}")
    bounds = {name: float(getattr(limits, name)[joint - 1]) for name in ("velocity", "acceleration", "jerk")}
    for name, value in bounds.items():
        if value <= 0.0:
            raise InfeasibleError(
                f"its {name} limit is {value:g}: it cannot move", joint=joint, allowed=f"a {name} limit above zero"
            )
    return bounds["velocity"], bounds["acceleration"], bounds["jerk"]

"""From the optimal series to a whole experiment: approach, excitation, one stroke a joint, moves, return."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from oed.retiming import plan_move
from oed.trajectories import PiecewisePolynomial, Segment, Sequence, Trajectory, velocity_reaching_stroke
from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.limits import Limits


def assemble(
    excitation: Trajectory,
    limits: Limits,
    *,
    period: float,
    home: ArrayLike | None = None,
    kind: str = "fourier",
    strokes: bool | tuple[int, ...] = True,
) -> Sequence:
    """Joins the parts of an excitation experiment; the robot rests at both ends.

    Approach from the home pose, the optimised part, then per joint a stroke there and back that reaches its
    velocity bound both ways where its range allows (thesis eq. 81 to 83), jerk-limited moves in between, and back home.

    Args:
        excitation: the optimised part; at rest at its ends.
        limits: that all parts keep.
        period: the controller's period [s].
        home: pose (n,) where it begins and ends; by default `Limits.home`.
        kind: of the optimised part's segment.
        strokes: with the strokes of all joints, of some (counted from 1), or of none.

    Returns:
        The experiment.

    Raises:
        InputError: a duration of the excitation that is no multiple of the controller's period, a home pose outside the
            limits.
        InfeasibleError: a limit of zero.
    """
    pose = rest_pose(limits, home)
    parts = [Segment(kind=kind, trajectory=excitation)]
    joints = (tuple(range(1, limits.n + 1)) if strokes else ()) if isinstance(strokes, bool) else strokes
    for joint in joints:
        stroke = velocity_reaching_stroke(limits, joint, pose, period=period)
        parts.append(Segment(kind="sinusoid", trajectory=stroke, joint=joint))
    segments: list[Segment] = []
    here = pose
    for number, part in enumerate(parts):
        start, end = _ends(part)
        segments += _move("move" if number else "approach", limits, here, start, period)
        segments.append(part)
        here = end
    segments += _move("move", limits, here, pose, period)
    return Sequence(segments=tuple(segments), period=period)


def rest_pose(limits: Limits, home: ArrayLike | None) -> Array:
    """Checks a home pose (n,); without one, takes `Limits.home`.

    Raises:
        InputError: a pose of another shape, or outside the limits.
    """
    pose = limits.home if home is None else np.asarray(home, dtype=float)
    if pose.shape != limits.lower.shape:
        raise InputError(f"the home pose has shape {pose.shape}", allowed=f"{limits.lower.shape}")
    outside = ~((pose >= limits.lower) & (pose <= limits.upper))
    if outside.any():
        joint = int(np.argmax(outside))
        raise InputError(
            f"the home pose {pose[joint]:g} lies outside the position limits",
            joint=joint + 1,
            allowed=f"{limits.lower[joint]:.4g} to {limits.upper[joint]:.4g} {limits.unit(joint)}",
        )
    return pose


def _ends(segment: Segment) -> tuple[Array, Array]:
    q = segment.trajectory.sample(np.array([0.0, segment.trajectory.duration])).q
    return q[0], q[1]


def limits_between_samples(limits: Limits, period: float) -> Limits:
    """Lowers jerk and acceleration so that the moves keep the limits between the samples, too."""
    # The jerk of a move jumps between the file's samples. A quintic through their positions, velocities and
    # accelerations, as a controller may interpolate them, makes up to 1.75 times the jerk of it, and 0.024 jerk periods
    # more acceleration.
    jerk = np.minimum(limits.jerk / 1.75, limits.acceleration / period)
    return replace(limits, jerk=jerk, acceleration=limits.acceleration - 0.024 * jerk * period)


def _move(kind: str, limits: Limits, start: Array, end: Array, period: float) -> list[Segment]:
    planned = plan_move(limits_between_samples(limits, period), start, end, period=period)
    if planned is None:
        return []
    pieces = PiecewisePolynomial(breakpoints=planned.breakpoints, coefficients=planned.coefficients)
    return [Segment(kind=kind, trajectory=pieces)]

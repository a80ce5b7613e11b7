"""A slow move from where a robot was stopped back to the pose at which stages begin."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from oed.campaigns.clearances import CollisionFreeRanges
from oed.retiming import plan_move
from oed.trajectories import PiecewisePolynomial
from robots.collision import CollisionModel, check_motion
from robots.common.errors import InfeasibleError
from robots.limits import Limits
from robots.robot import Robot
from robots.signals import Motion

Array = NDArray[np.float64]

SLOW = 0.2
"""Share of the velocity limits: a person may stand near a robot that was stopped."""


def move_home(robot: Robot, pose: Array, home: Array, bodies: CollisionModel | None) -> Motion | None:
    """Plans a slow move home on a way that is proved free of collisions.

    Args:
        robot: the robot.
        pose: where it stands (n,) [rad or m].
        home: where it has to go (n,).
        bodies: what has to stay apart on the way; None for a way that is not checked.

    Returns:
        The motion at the controller's period; None where the robot stands at home.

    Raises:
        InfeasibleError: no way is proved free, or the robot stands outside its position limits.
    """
    limits = robot.limits.scaled(velocity=SLOW, acceleration=SLOW**2, jerk=SLOW**3)
    if bodies is None or not bodies.pairs:
        return _along((pose, home), limits, robot.period)
    for way in CollisionFreeRanges(bodies, home).ways(pose, home):
        motion = _along(way, limits, robot.period)
        if motion is None or check_motion(bodies, motion, confirm=False).certified:
            return motion
    raise InfeasibleError(
        "no way from where the robot stands to the home pose is proved free of collisions",
        remedy="move the robot home by hand, then start again",
    )


def _along(poses: tuple[Array, ...], limits: Limits, period: float) -> Motion | None:
    """Joins the moves between poses; each sample counts once."""
    joined: Motion | None = None
    for start, end in pairwise(poses):
        planned = plan_move(limits, start, end, period=period)
        if planned is None:
            continue
        pieces = PiecewisePolynomial(breakpoints=planned.breakpoints, coefficients=planned.coefficients)
        part = pieces.motion(period)
        if joined is not None:
            part = Motion.concatenate([joined, part.slice(1, None)], shift=True)
        joined = part
    return joined

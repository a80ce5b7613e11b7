"""A trajectory as messages: one point a sample."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from oed.exports.simple_message.kinds import MESSAGE_JOINTS, PointType
from oed.exports.simple_message.messages import FullPoint, Point
from robots.common.errors import InputError

if TYPE_CHECKING:
    from robots.limits import Limits
    from robots.signals import Motion


def trajectory_points(
    motion: Motion,
    limits: Limits | None = None,
    *,
    kind: PointType = "full",
    robot_id: int = 0,
    resting: float = 0.0,
    further: tuple[float, ...] = (),
) -> Iterator[FullPoint | Point]:
    """Makes the points of a motion, numbered from 0.

    Args:
        motion: with up to ten joints; its first sample is at time zero for the controller.
        limits: velocity limits, for the share of points of the short type.
        kind: ``full`` for JOINT_TRAJ_PT_FULL, ``short`` for JOINT_TRAJ_PT.
        robot_id: which robot of the controller.
        further: positions of axes behind those of the motion, in each point [rad or m].
        resting: share of the speed in short points at rest.

    Raises:
        InputError: too many joints, another type, or the short type without limits.
    """
    if motion.n > MESSAGE_JOINTS:
        raise InputError(f"{motion.n} joints", allowed=f"up to {MESSAGE_JOINTS}, as simple_message has")
    if kind not in ("full", "short"):
        raise InputError(f"points of type {kind!r}", allowed="full or short")
    t = motion.t - motion.t[0]
    q, dq, ddq = motion.q.tolist(), motion.dq.tolist(), motion.ddq.tolist()
    if kind == "full":
        for k, time in enumerate(t.tolist()):
            yield FullPoint(
                robot_id=robot_id,
                sequence=k,
                time=time,
                positions=(*q[k], *further),
                velocities=tuple(dq[k]),
                accelerations=tuple(ddq[k]),
            )
        return
    if limits is None:
        raise InputError("points of type short need velocity limits", remedy="give the robot, or send full points")

    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.nan_to_num(np.abs(motion.dq) / limits.velocity).max(axis=1).clip(0.0, 1.0)
    share = np.where(share > 0, share, resting).tolist()
    durations = np.diff(t, prepend=0.0).tolist()
    for k in range(len(motion)):
        yield Point(sequence=k, positions=(*q[k], *further), velocity=share[k], duration=durations[k])

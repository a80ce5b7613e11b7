"""What the geometric errors of an arm depend on at each pose: positions, loads, temperature, direction of approach."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robots.common.arrays import Array
from robots.robot import Robot


@dataclass(frozen=True, kw_only=True, eq=False)
class ArmState:
    """An arm at N poses.

    Attributes:
        q: joint positions as the controller reads them (N, n) [rad or m].
        load: force and moment of gravity on all that joint i carries, about the joint frame's origin and in its axes
            (N, n, 6) [N, N m]; None where masses are not known.
        temperature: above the reference (N,) [K]; None where it was not measured.
        approach: 1, -1 or 0 per joint, the direction of its last motion (N, n); None where it is not known.
        session: number of the session of each pose (N,); None if there is one only.
        velocity: of the joints while the pose was measured (N, n) [rad/s or m/s]; None if the arm stood still.
    """

    q: Array
    load: Array | None = None
    temperature: Array | None = None
    approach: Array | None = None
    velocity: Array | None = None
    session: NDArray[np.int64] | None = None

    @property
    def rows(self) -> int:
        """Number of poses."""
        return len(self.q)


def gravity_loads(robot: Robot, q: Array, *, inertia: Array | None = None) -> Array:
    """Computes what gravity does to all that a joint carries, about the joint.

    Args:
        robot: the robot; its nominal geometry is used, which loads need no better.
        q: (N, n) [rad or m].
        inertia: inertial parameters (n, 10) in place of the robot's.

    Returns:
        (N, n, 6) force [N], then moment about the origin of joint frame i [N m], in the axes of that frame.
    """
    known = np.asarray(robot.inertia if inertia is None else inertia)
    chain = robot.chain
    poses = chain.transforms(q)
    mass, first = known[:, 0], known[:, 1:4]
    # Sum of mass, and of mass times position in the base frame, of the links beyond each joint.
    centres = (poses[..., :3, :3] @ first[:, :, None])[..., 0] + mass[:, None] * poses[..., :3, 3]
    beyond = np.cumsum(centres[:, ::-1], axis=1)[:, ::-1]
    carried = np.cumsum(mass[::-1])[::-1]
    gravity = np.asarray(chain.gravity)
    loads = np.empty((len(q), chain.n, 6))
    before = np.tile(np.eye(4), (len(q), 1, 1))
    for i, joint in enumerate(chain.joints):
        frame = before @ joint.placement
        turned = np.swapaxes(frame[:, :3, :3], 1, 2)
        moment = np.cross(beyond[:, i] - carried[i] * frame[:, :3, 3], gravity)
        loads[:, i, :3] = turned @ (carried[i] * gravity)
        loads[:, i, 3:] = (turned @ moment[..., None])[..., 0]
        before = poses[:, i]
    return loads
